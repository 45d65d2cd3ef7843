"""When the judge believes a cause, with simulations that are written down here."""

from types import SimpleNamespace

import numpy as np
import pytest

from sysid.diagnosis.replay.band import EVERY
from sysid.diagnosis.search import judge as module
from sysid.diagnosis.search.judge import LEAST_FALL, LEVEL, Judge
from sysid.diagnosis.search.selection import NOMINAL_THRESHOLD

ENOUGH = 2.0 * NOMINAL_THRESHOLD


class Said(Judge):
    """A judge whose simulations gain so much, differ so clearly, and fall so far.

    The angle's errors, in units of its noise, are those of `angle` before and after,
    and `costs` those of the fits as it ends and within tolerances.
    """

    angle, costs = (1.0, 1.0), (0.0, 0.0)

    def __init__(self, gain, t, repeat=True, effort=True, fall=2.0 * LEAST_FALL):
        data = SimpleNamespace(valid=np.ones((4, 1), bool), effort=np.array([effort]))
        space = SimpleNamespace(of=lambda effect: [])
        problem = SimpleNamespace(data=data, known="both", repeat=repeat, space=space)
        problem.inflated = (1.0, 1.0)
        super().__init__(problem, None)
        self.gain, self.t, self.share = gain, t, fall
        self.output = SimpleNamespace(samples=4)

    def moved(self, model):
        return self._fitted(model, self.angle[1], self.costs[0])

    def nominal(self, model):
        return self._fitted(model, self.angle[0], self.costs[1])

    def without(self, smaller, after):
        return self.nominal(smaller)

    @staticmethod
    def _fitted(model, left, cost):
        more = {"errors": np.array([left]), "fit": SimpleNamespace(cost=cost)}
        return SimpleNamespace(**vars(model) | more)

    def t_value(self, worse, better):
        return self.t

    def fall(self, worse, better):
        return self.share


@pytest.fixture(autouse=True)
def _gains(monkeypatch):
    def gain(smaller, larger, _samples):
        return smaller.fit.cost + larger.gain

    monkeypatch.setattr(module, "log_likelihood_gain", gain)


def says(judge, before=1.0, after=1.0):
    """Its verdict on models that leave so much of the equations' errors."""
    errors = [np.array([1.0, x]) for x in (before, after)]
    models = [SimpleNamespace(effects=(), errors=x) for x in errors]
    models[1].gain = judge.gain
    return judge.confirms(*models)


def test_an_angle_that_is_predicted_better_confirms():
    assert says(Said(ENOUGH, 2.0 * LEVEL))


def test_what_the_angle_does_not_need_is_no_cause():
    assert not says(Said(0.0, 2.0 * LEVEL))


@pytest.mark.parametrize(
    ("costs", "counts"),
    [((ENOUGH, 0.0), False), ((0.0, ENOUGH), False), ((ENOUGH, ENOUGH), True)],
)
def test_a_fit_that_ended_in_a_valley_of_its_own_is_no_gain(costs, counts):
    judge = Said(0.0, 2.0 * LEVEL)
    judge.costs = costs
    assert says(judge) is counts


def test_a_difference_that_is_sure_but_small_is_no_cause():
    """A servo's cycle on a quiet encoder: 0.102 mrad become 0.101 by 12 nat."""
    assert says(Said(ENOUGH, 9.0, fall=1.1 * LEAST_FALL))
    small = Said(ENOUGH, 9.0, fall=0.9 * LEAST_FALL)
    assert not says(small)
    said = {"effects": (), "errors": np.ones(2), "gain": ENOUGH}
    nothing, cause = (SimpleNamespace(**said) for _ in range(2))
    assert small.prefers(nothing, cause)  # beside a cause that counts


@pytest.mark.parametrize(
    ("angle", "repeat", "matters"),
    [
        ((2.8, 1.1), True, True),
        ((2.8, 1.1), False, False),
        ((1.1, 1.0), True, False),
        ((9.9, 9.6), True, False),
        ((2.1, 1.9), True, False),
        ((2.01, 1.49), True, False),
    ],
)
def test_an_error_that_becomes_all_but_noise_matters(angle, repeat, matters):
    """A slew limit by direction: noise is most of the error, and all that it leaves.

    A tilt in the place of a cable that goes slack leaves half of what was more.
    """
    judge = Said(ENOUGH, 2.0 * LEVEL, repeat=repeat, fall=0.6 * LEAST_FALL)
    judge.angle = angle
    assert says(judge) == matters


@pytest.mark.parametrize(("left", "matters"), [(1.9, True), (2.1, False)])
def test_the_noise_of_an_encoder_is_known_without_repeats(monkeypatch, left, matters):
    """Coarse targets: 2.8 times it is `unexplained`, and the grid leaves 1.9."""
    monkeypatch.setattr(module, "OutputProblem", SimpleNamespace)
    judge = Said(ENOUGH, 4.5, repeat=False, fall=0.6 * LEAST_FALL)
    judge.angle = (2.8, left)
    assert says(judge) == matters


def test_effort_without_another_explanation_counts_where_the_angle_hides_it():
    """Friction that a servo's damping hides: 381 times the noise becomes none."""
    assert says(Said(1.4, 7.4), before=381.0, after=0.5)


@pytest.mark.parametrize(
    ("t", "before", "after", "counts"),
    [(1.7, 135.0, 1.3, True), (1.7, 2.1, 1.2, False), (-1.7, 135.0, 1.3, False)],
)
def test_such_an_effort_matters_itself_where_little_goes_of_the_angle(
    t, before, after, counts
):
    """Viscous friction: 135 times the noise becomes 1.3, and 2 % of the angle's go."""
    assert says(Said(6.4, t, fall=0.02), before, after) is counts


@pytest.mark.parametrize(
    ("gain", "t", "after", "counts"),
    [
        (ENOUGH, 2.0 * LEVEL, 1.0, True),
        (ENOUGH, 2.0 * LEVEL, 1.2, False),
        (ENOUGH, 0.5 * LEVEL, 1.0, False),
        (0.5 * NOMINAL_THRESHOLD, 2.0 * LEVEL, 1.0, False),
    ],
)
def test_an_effort_that_falls_far_matters_where_the_angle_shows_the_cause(
    gain, t, after, counts
):
    """Viscous friction: a ninth goes of the angle by 74 nat, and 42 % of the effort."""
    assert says(Said(gain, t, fall=0.11), 1.9, after) is counts


def test_of_an_angle_alone_the_error_that_was_fitted_is_no_such_effort():
    judge = Said(ENOUGH, 2.0 * LEVEL, fall=0.11)
    judge.output = judge.problem
    judge.problem.samples = 4
    assert not says(judge, 1.9, 1.0)


def test_where_the_angle_is_searched_its_error_explains_no_effort(monkeypatch):
    """Although an effort was logged; else such a fall of its error would be enough."""
    judge = Said(-0.7, 2.0 * LEVEL, fall=0.11)
    judge.output = judge.problem
    judge.problem.samples = 4
    assert says(judge, 14.1, 0.92)
    monkeypatch.setattr(module, "OutputProblem", SimpleNamespace)
    assert not says(judge, 14.1, 0.92)


def test_an_effort_that_some_records_lack_is_no_proof():
    judge = Said(-0.7, 2.0 * LEVEL, fall=0.0)
    assert says(judge, 14.1, 0.92)
    judge.problem.data.effort = np.array([True, False])
    assert not says(judge, 14.1, 0.92)


def test_an_angle_that_does_not_show_it_need_only_come_nearer_at_all():
    """Viscous friction behind gains known to half: t of 1.05, or by chance of 0.9."""
    assert says(Said(-0.7, 0.1 * LEVEL, fall=0.0), before=5.8, after=1.0)
    assert not says(Said(-0.7, 0.0, fall=0.0), before=5.8, after=1.0)
    assert not says(Said(-0.7, 0.1 * LEVEL, fall=0.0), before=5.8, after=2.5)
    assert not says(Said(ENOUGH, 0.1 * LEVEL), before=1.8, after=1.0)


@pytest.mark.parametrize(
    ("t", "before", "after", "counts"),
    [
        (0.55, 14.1, 0.92, True),
        (-0.55, 14.1, 0.92, False),
        (0.55, 1.44, 0.92, False),
        (0.55, 14.1, 3.7, False),
        (0.55, 2.5, 1.9, False),
    ],
)
def test_without_repeats_an_effort_that_becomes_noise_is_explained(
    t, before, after, counts
):
    """Viscous friction, which the angle does not show; 1.44 without any effect."""
    judge = Said(-0.7, t * LEVEL, repeat=False, fall=0.0)
    assert says(judge, before, after) is counts


@pytest.mark.parametrize(("inflated", "counts"), [(1.5, True), (10.0, False)])
def test_what_a_first_answer_left_is_no_measure_of_an_effort(inflated, counts):
    """In units of a noise ten times too large, five times the noise looks like half."""
    judge = Said(-0.7, 2.0 * LEVEL, repeat=False, fall=0.0)
    judge.problem.inflated = (1.0, inflated)
    assert says(judge, before=10.0, after=0.5) is counts


def test_without_repeats_next_to_nothing_of_more_than_noise_must_remain():
    """A torque limit: 17,495 times what neighbours do not share becomes 50."""
    assert says(Said(1.4, 7.4, repeat=False), before=17_495.0, after=50.0)
    assert not says(Said(1.4, 7.4, repeat=False), before=1_000.0, after=40.0)


@pytest.mark.parametrize(
    "changed",
    [
        {"t": -0.5 * LEVEL},
        {"repeat": False, "after": 8.0},
        {"effort": False},
        {"after": 100.0},
        {"before": 1.8},
        {"after": 2.1, "fall": 0.9 * LEAST_FALL},
    ],
)
def test_it_does_not_count_otherwise(changed):
    """The angle comes (next to) no nearer, there is no effort, or much remains."""
    left = {"before": 381.0, "after": 0.5, **changed}
    sizes = {k: left.pop(k) for k in ("before", "after")}
    assert not says(Said(**{"gain": 1.4, "t": 7.4, **left}), **sizes)


@pytest.mark.parametrize(("weight", "counts"), [(1.0, True), (0.03, False)])
def test_an_angle_that_is_uncertain_in_motion_speaks_for_no_cause(
    monkeypatch, weight, counts
):
    """A cycle of a fast servo: most of the error goes where it weighs little."""
    monkeypatch.setattr(module, "OutputProblem", SimpleNamespace)
    fast = np.arange(40) % 4 == 0
    data = SimpleNamespace(valid=np.ones((40, 1), bool), dt=1.0)
    problem = SimpleNamespace(data=data, known="both", block_s=4.0 * EVERY)
    judge, left = Judge(problem, None), np.where(fast, 2.0, 1.05)[:, None]
    weights = np.where(fast, weight, 1.0)[:, None]
    judge.output = SimpleNamespace(weight=np.stack([np.ones_like(weights), weights]))
    models = SimpleNamespace(), SimpleNamespace()
    judge.errors[id(models[0])] = (models[0], np.where(fast[:, None], 9.0, 1.0))
    judge.errors[id(models[1])] = (models[1], left)
    assert (judge.fall(*models) > LEAST_FALL) is counts
    assert bool(judge.t_value(*models) > LEVEL) is counts
