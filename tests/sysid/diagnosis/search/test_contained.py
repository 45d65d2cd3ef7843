"""Dry friction, or friction that falls with speed? The angle has to show the more."""

from types import SimpleNamespace
from typing import Any

import pytest

from sysid.diagnosis.search.contained import plainest, shows_more
from sysid.diagnosis.search.search import _confirmed


def model(*effects) -> Any:
    return SimpleNamespace(effects=effects, errors=SimpleNamespace(max=lambda: 1.0))


NONE = model()
DRY, FALLING = model("coulomb_friction"), model("stribeck_friction")
VISCOUS = model("viscous_friction")


def judge(*, shown=(), refused=(), angle_alone=False) -> Any:
    """A judge to whom the angle shows these effects more than dry friction."""
    said: Any = SimpleNamespace(problem="equations", output="angle")
    if angle_alone:
        said.output = said.problem
    said.shows = lambda smaller, larger: larger.effects[-1] in shown
    said.confirms = lambda smaller, larger: larger.effects[-1] not in refused
    said.prefers = said.confirms
    return said


@pytest.mark.parametrize(
    ("by", "takes"),
    [
        (judge(), DRY),
        (judge(shown=["stribeck_friction"]), FALLING),
        (judge(angle_alone=True), FALLING),
        (judge(refused=["coulomb_friction"]), FALLING),
    ],
)
def test_friction_falls_with_speed_if_the_angle_shows_it(by, takes):
    offered = [FALLING, VISCOUS, DRY]
    assert plainest(by, NONE, FALLING, offered) is takes
    assert _confirmed(by, NONE, offered) is takes


def test_what_contains_nothing_needs_no_more():
    assert plainest(judge(), NONE, VISCOUS, [VISCOUS, DRY, FALLING]) is VISCOUS
    assert plainest(judge(), NONE, DRY, [DRY, FALLING]) is DRY


def test_an_effect_beside_another_cause_is_asked_the_same():
    """The cause may stand anywhere in its model."""
    both = model("coulomb_friction", "deadband")
    falling = model("deadband", "stribeck_friction")
    assert not shows_more(judge(), both, falling)
    assert shows_more(judge(shown=["stribeck_friction"]), both, falling)
    assert shows_more(judge(), falling, both)
    assert shows_more(judge(), both, model("deadband", "viscous_friction"))
    assert shows_more(judge(), DRY, model("coulomb_friction", "stribeck_friction"))
