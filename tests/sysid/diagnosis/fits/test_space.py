"""From where searches begin, and what coordinates are."""

import numpy as np
import pytest
from jaxtyping import TypeCheckError
from support.plain_servo import problem_with


@pytest.mark.parametrize("name", ["slew_limit", "directional_slew"])
def test_some_start_is_near_every_limit_of_speed_that_a_record_meets(name):
    """A tenth too low a limit errs more than none: no fit comes back from there."""
    problem = problem_with()
    fastest = np.abs(np.asarray(problem.data.track.vel)).max()
    usual = problem.data.speed_scale
    for slot in (problem.space.slots[i] for i in problem.space.of(name)):
        starts = slot.value(np.array(slot.starts))
        for limit in np.geomspace(0.7 * usual, max(fastest, 3.0 * usual), 40):
            assert np.abs(np.log(starts / limit)).min() < 0.06


def test_some_start_is_near_every_torque_that_unknown_gains_leave():
    """Of what the targets alone would ask for, where no effort was logged.

    At two thirds of the torque that a motion takes a joint falls, at all of it a limit
    has no slope.
    """
    problem = problem_with()
    (index,) = problem.space.of("torque_limit")
    slot = problem.space.slots[index]
    starts = slot.value(np.array(slot.starts))
    for limit in problem.data.torque_scale * np.geomspace(0.0025, 1.0, 60):
        assert np.abs(np.log(starts / limit)).min() < 0.08
    assert slot.high > max(slot.starts)


def test_some_start_is_near_every_acceleration_of_a_stiff_servo():
    """Of a step it takes a few milliseconds to its speed."""
    problem = problem_with()
    (index,) = problem.space.of("acceleration_limit")
    slot = problem.space.slots[index]
    starts = slot.value(np.array(slot.starts))
    for rise_s in np.geomspace(0.002, 1.0, 40):
        assert np.abs(np.log(starts * rise_s / problem.data.speed_scale)).min() < 0.16


def test_how_an_effort_is_read_belongs_to_a_record():
    """Predicting a fold, it would go where the noise of the others does."""
    space = problem_with().space
    assert [space.slots[i].name for i in space.local()] == ["ripple"]


def test_sizes_that_may_have_either_sign_begin_small_too():
    """Where a joint swings at its limit a tenth of all torques is no start."""
    space = problem_with().space
    for i in space.of("asymmetric_viscous"):
        starts = np.array(space.slots[i].starts)
        assert sorted(starts[np.abs(starts) < 0.05]) == [-0.01, 0.01]


@pytest.mark.parametrize(
    "effect", ["encoder_scale", "stiffness", "encoder_eccentricity"]
)
def test_no_prior_holds_back_the_size_of_one_effect_more_than_of_another(effect):
    """A score has no part of it: the effect that may go further would seem nearer."""
    space = problem_with().space
    free = space.prior_sds((effect,))[space.of(effect)]
    assert free == pytest.approx(5.0)


def test_values_of_all_coordinates_are_those_of_each():
    """To the last digit, where they vanish and where they overflow, too."""
    space = problem_with().space
    thetas = space.nominal + np.random.default_rng(7).normal(0.0, 1.0, (5, 1))
    thetas = np.vstack([thetas, np.zeros_like(space.nominal), 100.0 + space.nominal])
    params, nuisance = space.values(thetas)
    for slot, column in zip(space.slots, thetas.T, strict=True):
        known = params[slot.effect] if slot.effect else vars(nuisance)
        with np.errstate(over="ignore"):
            expected = slot.value(column).astype(np.float32)
        assert known[slot.name].tobytes() == expected.tobytes(), slot.label


def test_a_candidate_alone_is_refused():
    """The shapes of methods are checked while the tests run."""
    space = problem_with().space
    with pytest.raises(TypeCheckError):
        space.values(space.nominal)
