"""Between effects that the equations hardly distinguish, the angle decides."""

from types import SimpleNamespace
from typing import Any

import pytest

from sysid.diagnosis.search import decided
from sysid.diagnosis.search.decided import decided_by_angle


def model(effect, equations, angle):
    """A model by what it is ahead of none, in nat, in the equations and by angle."""
    effects = (effect,) if effect else ()
    return SimpleNamespace(effects=effects, equations=equations, angle=angle)


NONE = model("", 0.0, 0.0)
COUPLED = model("joint_coupling", 10.0, 600.0)


def judge_of(refused=(), output="angle"):
    """A judge that confirms all but some effects."""
    judge: Any = SimpleNamespace(sees=True, known=[])
    judge.problem = SimpleNamespace(samples="equations")
    judge.output = SimpleNamespace(samples="angle") if output else judge.problem
    judge.moved = lambda m: m
    judge.confirms = lambda without, m: m.effects[0] not in refused
    judge.knows = lambda m, fit: judge.known.append((m, fit))
    return judge


@pytest.fixture(autouse=True)
def _likelihoods(monkeypatch):
    def gap(candidate, best, samples):
        return getattr(best, samples) - getattr(candidate, samples)

    monkeypatch.setattr(decided, "likelihood_gap", gap)
    monkeypatch.setattr(decided, "nearest", lambda judge, m: m)
    monkeypatch.setattr(decided, "extended", lambda output, m: [COUPLED])


def decide(best, others, judge=None):
    effect = best.effects[0]
    parts: Any = ({effect: others}, {effect: NONE})
    return decided_by_angle(judge or judge_of(), best, *parts)


def test_what_the_angle_prefers_by_more_takes_the_place():
    best = model("payload_com", 17.0, 300.0)
    assert decide(best, [COUPLED]) is COUPLED


@pytest.mark.parametrize(
    ("best", "others", "judge"),
    [
        # The angle gains no more than the equations lose.
        (model("payload_com", 100.0, 50.0), [model("stiffness", 60.0, 80.0)], None),
        # The equations are sure, and speak against it.
        (model("payload_com", 700.0, 300.0), [COUPLED], None),
        # Its simulation is not confirmed.
        (model("payload_com", 17.0, 300.0), [COUPLED], judge_of(["joint_coupling"])),
        # The angle itself was searched.
        (model("payload_com", 17.0, 300.0), [COUPLED], judge_of(output=None)),
        # It contains the cause at an end of its shape.
        (
            model("coulomb_friction", 90.0, 80.0),
            [model("stribeck_friction", 90.0, 120.0)],
            None,
        ),
    ],
)
def test_the_answer_of_the_equations_stays_otherwise(best, others, judge):
    assert decide(best, others, judge) is None


def test_where_the_angle_shows_more_it_is_asked_what_it_prefers():
    """Whatever the equations think of that, and as it was fitted to the angle."""
    judge, far = judge_of(), model("joint_coupling", 1.0, 600.0)
    assert decide(model("payload_com", 17.0, 300.0), [far], judge) is far
    assert judge.known == [(far, COUPLED)]


def test_an_answer_without_causes_stays():
    assert decided_by_angle(judge_of(), NONE, {}, {}) is None  # type: ignore[arg-type]
