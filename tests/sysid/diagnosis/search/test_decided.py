"""Between effects that the equations hardly distinguish, the angle decides."""

from types import SimpleNamespace
from typing import Any

import pytest

from sysid.diagnosis.search import decided
from sysid.diagnosis.search.decided import decided_by_angle


def model(effect, equations, angle, stage=None, fitted=None):
    """A model by what it is ahead of none, in nat, in the equations and by angle.

    Args:
        effect: "" for none.
        equations, angle: nat, on data that a fit did not see.
        stage: by angle, where it was begun in many places; as it is, if not given.
        fitted: by angle, on data that the fit saw; as much, if not given.
    """
    effects = (effect,) if effect else ()
    more = angle if stage is None else stage
    seen = more if fitted is None else fitted
    return SimpleNamespace(
        effects=effects, equations=equations, angle=angle, stage=more, fitted=seen
    )


NONE = model("", 0.0, 0.0)
LOAD = model("payload_com", 17.0, 300.0)
COUPLED = model("joint_coupling", 10.0, 600.0)


class Judge:
    """Confirms all but some effects, and knows the angle by the models themselves."""

    sees = True

    def __init__(self, refused=(), output=True):
        self.refused, self.better = refused, {}
        self.problem = SimpleNamespace(samples="equations")
        self.output = SimpleNamespace(samples="angle") if output else self.problem

    def moved(self, model):
        return self.better.get(model.effects, model)

    def knows(self, model, fit):
        self.better[model.effects] = fit

    def confirms(self, without, model):
        return model.effects[0] not in self.refused


@pytest.fixture(autouse=True)
def implausible(monkeypatch):
    """Likelihoods that are written down; effects named here cannot be."""
    names: set[str] = set()

    def gap(candidate, best, samples):
        return getattr(best, samples) - getattr(candidate, samples)

    def fitted(candidate, best, samples):
        assert samples == "angle"
        return best.fitted - candidate.fitted

    def plausible(problem, smaller, larger):
        return larger.effects[0] not in names

    monkeypatch.setattr(decided, "likelihood_gap", gap)
    monkeypatch.setattr(decided, "fitted_gap", fitted)
    monkeypatch.setattr(decided, "plausible", plausible)
    monkeypatch.setattr(decided, "threshold_of", lambda *args: 12.0)
    monkeypatch.setattr(decided, "nearest", lambda judge, m: judge.moved(m))
    return names


def decide(monkeypatch, best, others, judge=None):
    judge = judge or Judge()

    def extended(output, base):
        begun = [
            model(m.effects[0], 0.0, m.stage, fitted=m.fitted) for m in (best, *others)
        ]
        return sorted(begun, key=lambda m: -m.angle)

    monkeypatch.setattr(decided, "extended", extended)
    parts: Any = judge, NONE, best, others
    return decided_by_angle(*parts)


def test_what_the_angle_prefers_by_more_takes_the_place(monkeypatch):
    said = decide(monkeypatch, LOAD, [model("stiffness", 9.0, 350.0), COUPLED])
    assert said is not None
    assert said.best is COUPLED
    # By angle, less what it is behind in the equations, of each.
    leads = {("payload_com",): 293.0, ("stiffness",): 251.0}
    assert said.leads == leads | {(): 600.0}


def test_a_lead_is_the_smaller_of_both(monkeypatch):
    """Held out 250 nat, fitted 230; both less what it is behind in the equations."""
    others = [model("stiffness", 9.0, 350.0, fitted=370.0), COUPLED]
    said = decide(monkeypatch, LOAD, others)
    assert said is not None
    assert said.best is COUPLED
    assert said.leads[("stiffness",)] == 230.0 + 8.0 - 7.0


@pytest.mark.parametrize(
    ("best", "others", "judge"),
    [
        # The angle gains no more than the equations lose.
        (model("payload_com", 100.0, 50.0), [model("stiffness", 60.0, 80.0)], None),
        # The equations are sure, and speak against it.
        (model("payload_com", 700.0, 300.0), [COUPLED], None),
        # Its simulation is not confirmed.
        (LOAD, [COUPLED], Judge(["joint_coupling"])),
        # The angle itself was searched.
        (LOAD, [COUPLED], Judge(output=False)),
        # It contains the cause at an end of its shape.
        (
            model("coulomb_friction", 90.0, 80.0),
            [model("stribeck_friction", 90.0, 120.0)],
            None,
        ),
        # No simulation is exact: 1.5 % of what the cause gains is no difference.
        (model("damping", 90.0, 9000.0), [model("stiffness", 90.0, 9100.0)], None),
        # Chance: what it predicts of folds, it does not explain of all of them.
        (LOAD, [model("joint_coupling", 10.0, 600.0, fitted=290.0)], None),
        # From as many starts, the cause is as near.
        (model("payload_com", 17.0, 300.0, stage=595.0), [COUPLED], None),
    ],
)
def test_the_answer_of_the_equations_stays_otherwise(best, others, judge, monkeypatch):
    assert decide(monkeypatch, best, others, judge) is None


def test_what_cannot_be_takes_no_place(implausible, monkeypatch):
    implausible.add("joint_coupling")
    assert decide(monkeypatch, LOAD, [COUPLED]) is None


def test_two_causes_stay(monkeypatch):
    both = model("payload_com", 17.0, 300.0)
    both.effects = ("payload_com", "deadband")
    assert decide(monkeypatch, both, [COUPLED]) is None


@pytest.mark.parametrize(
    ("shown", "takes", "behind"),
    [("stribeck_friction", "stribeck_friction", 16.0), ("", "coulomb_friction", 13.0)],
)
def test_what_contains_another_takes_the_place_if_more_is_shown(
    shown, takes, behind, monkeypatch
):
    """At the same angle it would be ahead by the error of the equations alone."""
    judge: Any = Judge()
    judge.shows = lambda smaller, larger: larger.effects == (shown,)
    judge.explains = lambda smaller, larger: False
    load = model("payload_com", 100.0, 100.0)
    falls = model("stribeck_friction", 95.0, 301.0)
    dry, viscous = (
        model("coulomb_friction", 80.0, 300.0),
        model("viscous_friction", 82.0, 285.0),
    )
    said = decide(monkeypatch, load, [falls, dry, viscous], judge)
    assert said is not None and said.best.effects == (takes,)
    assert said.leads.get(("stribeck_friction",), 0.0) >= 0.0
    other = said.leads[("viscous_friction",)]
    assert other == pytest.approx(behind + 13.0 if shown else behind)
