"""Dry friction, or friction that falls with speed? More than that has to be shown."""

from types import SimpleNamespace
from typing import Any

import pytest

from sysid.diagnosis.search import search
from sysid.diagnosis.search.contained import plainer, shows_more
from sysid.diagnosis.search.search import _confirmed


def model(*effects) -> Any:
    return SimpleNamespace(effects=effects, errors=SimpleNamespace(max=lambda: 1.0))


NONE = model()
DRY, FALLING = model("coulomb_friction"), model("stribeck_friction")
YIELDING, VISCOUS = model("hysteresis"), model("viscous_friction")


def judge(*, shown=(), explained=(), refused=(), angle_alone=False) -> Any:
    """A judge to whom angle or effort show these effects more than dry friction."""
    said: Any = SimpleNamespace(problem="equations", output="angle")
    if angle_alone:
        said.output = said.problem
    said.shows = lambda smaller, larger: larger.effects[-1] in shown
    said.explains = lambda smaller, larger: larger.effects[-1] in explained
    said.confirms = lambda smaller, larger: larger.effects[-1] not in refused
    said.prefers = said.confirms
    return said


@pytest.fixture(autouse=True)
def ordered(monkeypatch):
    """Candidates stay in their order."""
    monkeypatch.setattr(search, "simplest_first", lambda problem, smaller, rest: rest)


@pytest.mark.parametrize(
    ("by", "takes"),
    [
        (judge(), DRY),
        (judge(shown=["stribeck_friction"]), FALLING),
        (judge(explained=["stribeck_friction"]), FALLING),
        (judge(angle_alone=True), FALLING),
        (judge(refused=["coulomb_friction"]), FALLING),
    ],
)
def test_friction_falls_with_speed_if_that_is_shown(by, takes):
    offered = [FALLING, DRY, VISCOUS]
    said = plainer(by, NONE, FALLING, offered)
    assert (said or FALLING) is takes
    assert _confirmed(by, NONE, offered) is takes


def test_the_next_takes_the_place_of_what_is_not_shown():
    """Not what it contains, which may be the last of all."""
    hysteresis = judge(shown=["hysteresis"])
    assert _confirmed(hysteresis, NONE, [FALLING, YIELDING, DRY]) is YIELDING
    assert _confirmed(judge(), NONE, [FALLING, YIELDING, DRY]) is DRY
    others = [model(str(n)) for n in range(9)]
    far = [FALLING, *others, DRY]
    alone = judge(refused=[m.effects[0] for m in others])
    assert _confirmed(alone, NONE, far) is DRY


def test_what_contains_nothing_needs_no_more():
    assert plainer(judge(), NONE, VISCOUS, [VISCOUS, DRY, FALLING]) is None
    assert plainer(judge(), NONE, DRY, [DRY, FALLING]) is None


def test_an_effect_beside_another_cause_is_asked_the_same():
    """The cause may stand anywhere in its model."""
    both = model("coulomb_friction", "deadband")
    falling = model("deadband", "stribeck_friction")
    assert not shows_more(judge(), both, falling)
    assert shows_more(judge(shown=["stribeck_friction"]), both, falling)
    assert shows_more(judge(), falling, both)
    assert shows_more(judge(), both, model("deadband", "viscous_friction"))
    assert shows_more(judge(), DRY, model("coulomb_friction", "stribeck_friction"))
