"""What could stand in the place of a cause, on searches that are written down here."""

from types import SimpleNamespace

import numpy as np
import pytest

from sysid.diagnosis.search.search import Search
from sysid.diagnosis.verdict.alternatives import alternatives_of

SAMPLES = 1000
NOISE = np.random.default_rng(0).normal(size=SAMPLES)


def model(effect, behind, moved=0.0):
    """A candidate that is so many nat behind, with a residual moved by so much."""
    score = 1000.0 + 2.0 * behind
    return SimpleNamespace(
        effects=(effect,) if effect else (),
        score=score,
        noise_cost=0.0,
        correlation=1.0,
        variance=lambda samples: max(1.0, score / samples),
        fit=SimpleNamespace(cost=score, residual=NOISE + moved / np.sqrt(SAMPLES)),
    )


@pytest.mark.parametrize(
    ("behind", "moved", "apart"),
    [
        (2.0, 9.0, False),
        (4.0, 9.0, True),  # the records say which
        (4.0, 0.3, False),  # only priors do
        (8.0, 0.3, True),  # and these do so clearly
    ],
)
def test_what_predicts_the_same_is_set_apart_by_priors_alone(behind, moved, apart):
    best, base = model("damping", 0.0), model("", 200.0, moved=50.0)
    other = model("viscous_friction", behind, moved)
    judge = SimpleNamespace(prefers=lambda smaller, larger: True)
    others = ({"damping": [other]}, {"damping": base}, [])
    found = Search(None, base, best, *others, SAMPLES, judge)
    (alternative,) = alternatives_of(found)
    assert alternative.effect == "viscous_friction"
    assert alternative.distinguishable == apart


def test_where_the_angle_decided_alternatives_are_behind_by_it():
    """The equations' answer is ahead of it in the equations, and refuted."""
    best, base = model("joint_coupling", 10.0), model("", 24.0, moved=50.0)
    first, close = model("payload_com", 0.0, 9.0), model("stiffness", 9.0, 9.0)
    other = model("armature", 11.0, 9.0)  # it was not asked
    judge = SimpleNamespace(prefers=lambda smaller, larger: True)
    others = ({"joint_coupling": [first, close, other]}, {"joint_coupling": base}, [])
    leads = {("payload_com",): 300.0, ("stiffness",): 2.0, (): 600.0}
    found = Search(None, base, best, *others, SAMPLES, judge, leads)
    said = {a.effect: (a.score_gap, a.distinguishable) for a in alternatives_of(found)}
    near, far = (2.0, False), (300.0, True)
    assert said == {"stiffness": near, "armature": near, "payload_com": far}
    assert found.gain("joint_coupling") == 600.0


def test_what_contains_a_cause_is_no_alternative_however_near():
    """Ahead by the equations, and refused where the angle shows no more."""
    best, base = model("coulomb_friction", 14.0), model("", 200.0, moved=50.0)
    falls, other = model("stribeck_friction", 0.0), model("viscous_friction", 16.0)
    judge = SimpleNamespace(prefers=lambda smaller, larger: True)
    parts = ({best.effects[0]: [falls, other]}, {best.effects[0]: base}, [])
    found = Search(None, base, best, *parts, SAMPLES, judge)
    assert [a.effect for a in alternatives_of(found)] == ["viscous_friction"]
