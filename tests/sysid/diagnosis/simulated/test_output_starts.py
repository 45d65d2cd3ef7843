"""Where fits to the angle begin: a servo of which nothing is known still is found."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest
from support.plain_servo import KD, KP, problem_with

from sysid.diagnosis.fits.candidate import fit_models
from sysid.diagnosis.fits.projected import linear_costs
from sysid.diagnosis.search.settling import settled
from sysid.diagnosis.simulated import output_starts as module
from sysid.diagnosis.simulated.closed_loop import simulated
from sysid.diagnosis.simulated.known import Known
from sysid.diagnosis.simulated.output_error import output_problem
from sysid.diagnosis.simulated.output_starts import (
    ALONE_TRIED,
    EQUATIONS_TRIED,
    MUCH,
    output_starts,
)
from sysid.diagnosis.simulated.settled_output import settled_output
from sysid.diagnosis.simulated.torque_scales import unknown_gains


def scales(problem, theta):
    """Of stiffness and damping, at some coordinates."""
    slots = problem.space.slots
    found = {s.label: float(s.value(u)) for s, u in zip(slots, theta, strict=True)}
    return found["stiffness.scale"], found["damping.scale"]


def moved_as(problem, theta):
    """The problem of a joint that moved as the simulation does at some coordinates."""
    pos = jnp.asarray(simulated(problem, theta[None])[0], jnp.float32)
    data = replace(problem.data, track=replace(problem.data.track, pos=pos))
    return replace(problem, data=data, seen=Known())


@pytest.fixture(scope="module")
def unknown():
    """A servo without effort that is believed three times as stiff, and soft."""
    problem = problem_with(believed=(3.0 * KP, 0.4 * KD))
    problem.data.effort[:] = False
    problem, base = settled(problem)
    return output_problem(problem), base


def test_gains_of_which_nothing_is_known_are_found(unknown):
    problem, base = settled_output(*unknown)
    found = scales(problem, base.fit.theta)
    assert found == pytest.approx((1.0 / 3.0, 1.0 / 0.4), rel=0.05)
    assert base.errors[1] < 1.5


def test_a_candidate_begins_at_two_places(unknown):
    problem, base = settled_output(*unknown)
    index = problem.space.of("encoder_offset")[0]
    others = np.arange(len(base.fit.theta)) != index
    far = problem.space.nominal.copy()
    far[index] = problem.space.slots[index].coordinate(0.01)
    proposed = fit_models(problem, [("encoder_offset",)], [far], rounds=0)
    (_, near), (effects, alone), (_, scaled) = output_starts(problem, base, proposed)
    assert effects == ("encoder_offset",)
    # Near: the offset fitted, all else as in the smaller model.
    assert near[index] != far[index]
    np.testing.assert_array_equal(near[others], base.fit.theta[others])
    # Alone: fitted, all else at nominal.
    assert alone[index] != far[index]
    np.testing.assert_array_equal(alone[others], problem.space.nominal[others])
    # And, of gains that nobody knows, fitted with them.
    others[unknown_gains(problem.space)] = False
    np.testing.assert_array_equal(scaled[others], problem.space.nominal[others])
    assert scales(problem, scaled) == pytest.approx((1.0 / 3.0, 1.0 / 0.4), rel=0.1)


def test_an_effect_that_shrinks_beside_what_took_its_place_is_tried(unknown):
    """A large play beside gains that have taken it up: alone nothing is left of it."""
    problem, base = settled_output(*unknown)
    index = problem.space.of("backlash")[0]
    true = base.fit.theta.copy()
    true[index] = 0.15
    problem = moved_as(problem, true)
    (base,) = fit_models(problem, [()], [base.fit.theta])
    names = ["encoder_offset", "payload_mass", "mount_tilt", "armature", "backlash"]
    sets = [(name,) for name in names if name in problem.space.effects]
    proposed = fit_models(problem, sets, [base.fit.theta] * len(sets), rounds=0)
    begun = [
        t[index]
        for e, t in output_starts(problem, base, proposed)
        if e[0] == "backlash"
    ]
    assert 0.15 in begun


@pytest.mark.parametrize("left", [1.0, 20.0])
def test_where_much_is_left_a_play_is_fitted_from_every_size(
    unknown, monkeypatch, left
):
    """From one of them alone a fit crosses no hill; of noise nothing is to be had."""
    problem, base = settled_output(*unknown)
    base = replace(base, errors=np.array([0.0, left]))
    proposed = fit_models(problem, [("backlash",)], [base.fit.theta], rounds=0)
    index = problem.space.of("backlash")[0]
    begun = []

    def fitted(problem, sets, starts, rounds, nearest):
        begun.extend(float(theta[index]) for theta in starts)
        return fit_models(problem, sets, starts, rounds=0, nearest=nearest)

    monkeypatch.setattr(module, "fit_models", fitted)
    output_starts(problem, base, proposed)
    every = list(problem.space.slots[index].starts)
    if left <= MUCH:
        assert begun == []
    else:  # and the nearest goes on
        assert begun[:-1] == every and begun[-1] in every


@pytest.mark.parametrize("name", ["load_friction", "deadband"])
def test_an_effect_of_a_twentieth_of_its_start_is_tried(unknown, name):
    """The nuisance parameters take up most of it; where they follow, all is left."""
    problem, base = settled_output(*unknown)
    index, true = problem.space.of(name)[0], base.fit.theta.copy()
    true[index] = problem.space.slots[index].starts[0] / 20.0
    problem = moved_as(problem, true)
    (base,) = fit_models(problem, [()], [base.fit.theta])
    sets = [(other,) for other in ("encoder_offset", "payload_mass", "armature", name)]
    proposed = fit_models(problem, sets, [base.fit.theta] * len(sets), rounds=0)
    begun = [t for e, t in output_starts(problem, base, proposed) if e == (name,)]
    nearest = min(begun, key=lambda t: abs(t[index] - true[index]))
    assert nearest[index] == pytest.approx(true[index], rel=0.1)
    rest, left = linear_costs(problem, base, np.stack([base.fit.theta, nearest]))
    assert left < 0.5 * rest


def test_a_limit_begins_in_the_direction_in_which_it_acts(unknown):
    """Equations that propose the other direction leave no slope that leads back."""
    problem, base = settled_output(*unknown)
    up, down = problem.space.of("directional_slew")
    true, said = base.fit.theta.copy(), base.fit.theta.copy()
    true[up] = said[down] = 1.0  # the speed that two of a hundred samples exceed
    problem = moved_as(problem, true)
    (base,) = fit_models(problem, [()], [base.fit.theta], rounds=0)
    proposed = fit_models(problem, [("directional_slew",)], [said], rounds=0)
    (_, near), *_ = output_starts(problem, base, proposed)
    assert near[up] == pytest.approx(true[up], rel=0.05)
    assert near[down] == 0.0


def test_what_comes_near_alone_is_tried_whatever_the_equations_say(
    unknown, monkeypatch
):
    # Of what begins beside other gains there is a test of its own.
    monkeypatch.setattr(module, "at_every_scale", lambda *args: [])
    problem, base = settled_output(*unknown)
    nominal = replace(base, fit=replace(base.fit, theta=problem.space.nominal))
    names = [e for e in problem.space.effects if e != "stiffness"]
    sets = [(name,) for name in (*names, "stiffness")]  # best first, by the equations
    starts = [problem.space.nominal] * len(sets)
    proposed = fit_models(problem, sets, starts, rounds=0)
    tried = list(dict.fromkeys(e for e, _ in output_starts(problem, nominal, proposed)))
    assert tried[:EQUATIONS_TRIED] == sets[:EQUATIONS_TRIED]
    assert ("stiffness",) in tried  # three times too stiff
    assert len(tried) <= EQUATIONS_TRIED + 2 * ALONE_TRIED < len(sets)


def test_what_left_its_tolerance_may_stand_for_the_effect_and_is_put_back(unknown):
    """Beside it, a candidate does nothing, or twice what it should."""
    problem, base = settled_output(*unknown)
    slots = problem.space.slots
    mass = [slot.label for slot in slots].index("mass")
    index = problem.space.of("acceleration_limit")[0]
    strained = base.fit.theta.copy()
    strained[mass] = 5.0 * slots[mass].prior_sd
    (base,) = fit_models(problem, [()], [strained], rounds=0)
    said = np.where(np.arange(len(slots)) == index, 1.0, strained)
    proposed = fit_models(problem, [("acceleration_limit",)], [said], rounds=0)
    effects, back = output_starts(problem, base, proposed)[-1]
    assert effects == ("acceleration_limit",)
    assert back[mass] == slots[mass].nominal
    others = ~np.isin(np.arange(len(slots)), [mass, index])
    np.testing.assert_array_equal(back[others], strained[others])
