"""Of gains that nobody knows each effect begins beside several."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from benchmarks.diagnosis.hidden.believed import believed, true_parameters
from benchmarks.diagnosis.hidden.cases import drawn_case
from benchmarks.diagnosis.hidden.conditions import Conditions
from sysid.diagnosis.diagnose import problem_of
from sysid.diagnosis.fits.candidate import CONVERGED, fit_models
from sysid.diagnosis.fits.parameters import Space
from sysid.diagnosis.replay.track import all_tracks
from sysid.diagnosis.search.settling import settled
from sysid.diagnosis.simulated.output_error import output_problem
from sysid.diagnosis.simulated.output_starts import ALONE_TRIED, output_starts
from sysid.diagnosis.simulated.settled_output import settled_output
from sysid.diagnosis.simulated.torque_scales import (
    SCALES,
    at_every_scale,
    origins_of,
    unknown_gains,
)

LOAD = "payload_mass"
NO_EFFORT = Conditions(
    lowpass_hz=3.0,
    effort=False,
    gains="unknown",
    rate_hz=100.0,
    repeats=False,
    motion="sines",
    round_s=4.0,
)


def proposed(*effects) -> Any:
    return [SimpleNamespace(effects=(name,)) for name in effects]


def softer(mechanism):
    """The mechanism with a third of the gains."""
    drives = {}
    for name, drive in mechanism.drives.items():
        gains = (replace(g, value=g.value / 3.0) for g in (drive.kp, drive.kd))
        drives[name] = replace(drive, **dict(zip(("kp", "kd"), gains, strict=True)))
    return replace(mechanism, drives=drives)


@pytest.fixture(scope="module")
def loaded():
    """A pendulum of the other simulator with a load, its base model, and the load."""
    case = drawn_case(2, (LOAD,), "medium", NO_EFFORT)
    mechanism, logs = softer(believed(case.stand, False)), list(case.logs)
    track = all_tracks(logs, mechanism)[0]
    problem, base = settled(problem_of(track, logs, mechanism, False))
    output = output_problem(problem)
    assert output is not None
    return *settled_output(output, base), true_parameters(case, LOAD)["mass_kg"]


def test_a_load_shows_how_large_the_gains_are(loaded):
    problem, base, true_kg = loaded
    (where,) = problem.space.of(LOAD)

    def fitted(start):
        model = fit_models(problem, [(LOAD,)], [start], rounds=CONVERGED)[0]
        return model, problem.space.slots[where].value(model.fit.theta[where])

    some = proposed("armature", "coulomb_friction", LOAD)
    starts = dict(at_every_scale(problem, base, some, 2))
    assert set(starts) == {(LOAD,), ("armature",)}  # a smaller rotor moves it alike
    model, mass_kg = fitted(starts[(LOAD,)])
    assert mass_kg == pytest.approx(true_kg, rel=0.1)
    # Without it all torques have shrunk, and from there a load of a third is found.
    stiffness = problem.space.of("stiffness")[0]
    assert base.fit.theta[stiffness] < model.fit.theta[stiffness] - 0.5
    near, too_small_kg = fitted(base.fit.theta)
    assert near.fit.cost > 1.2 * model.fit.cost
    assert too_small_kg < 0.5 * true_kg


def test_gains_begin_at_seven_sizes_in_the_ratio_of_the_fit(loaded):
    problem, base, _ = loaded
    gains, space = unknown_gains(problem.space), problem.space
    theta = base.fit.theta.copy()
    theta[gains] = -2.0, -1.6
    free = space.of("lowpass_cutoff")[0]
    theta[free] += 0.3
    slots = list(space.slots)
    slots[free] = replace(slots[free], prior_sd=np.inf)
    other = replace(problem, space=Space(tuple(slots)))
    origins = origins_of(
        other, replace(base, fit=replace(base.fit, theta=theta)), gains
    )
    assert [o[gains[0]] for o in origins] == pytest.approx(SCALES)
    assert [o[gains[1]] - o[gains[0]] for o in origins] == pytest.approx([0.4] * 7)
    # What has no nominal value stays where it was fitted.
    rest = np.setdiff1d(np.arange(len(theta)), gains)
    expected = space.nominal.copy()
    expected[free] = theta[free]
    assert all(np.array_equal(o[rest], expected[rest]) for o in origins)


def test_no_gain_begins_out_of_its_range(loaded):
    problem, base, _ = loaded
    gains = unknown_gains(problem.space)
    theta = base.fit.theta.copy()
    theta[gains] = -3.9, 3.9
    origins = origins_of(
        problem, replace(base, fit=replace(base.fit, theta=theta)), gains
    )
    most = problem.space.slots[gains[1]].high
    assert {o[gains[1]] for o in origins} == {most}


def test_they_are_starts_among_others(loaded):
    problem, base, _ = loaded
    sets = [("coulomb_friction",), ("armature",), (LOAD,)]
    stage = fit_models(problem, sets, [base.fit.theta] * len(sets), rounds=0)
    said = dict(at_every_scale(problem, base, stage, ALONE_TRIED))
    starts = output_starts(problem, base, stage)
    for effects, theta in said.items():
        assert any(e == effects and np.array_equal(u, theta) for e, u in starts)
    assert len(said) == len(sets) == ALONE_TRIED


def test_a_gain_begins_nowhere_itself(loaded):
    problem, base, _ = loaded
    starts = at_every_scale(problem, base, proposed("stiffness", "armature"), 2)
    assert [effects for effects, _ in starts] == [("armature",)]
    assert at_every_scale(problem, base, proposed("stiffness"), 2) == []


def test_what_an_effect_has_shown_is_not_asked_again(loaded):
    problem, base, _ = loaded
    larger = replace(base, effects=(LOAD,))
    assert at_every_scale(problem, larger, proposed("armature"), 2) == []


def test_an_effort_says_how_large_torques_are(loaded):
    problem, base, _ = loaded
    logged = replace(problem.data, effort=problem.data.effort | True)
    other = replace(problem, data=logged)
    assert at_every_scale(other, base, proposed("armature"), 2) == []


@pytest.mark.parametrize("effect", ["stiffness", "damping"])
def test_a_gain_that_is_known_says_it_too(loaded, effect):
    slots = loaded[0].space.slots
    free = unknown_gains(loaded[0].space)
    assert [slots[i].label for i in free] == ["stiffness.scale", "damping.scale"]
    known = [replace(s, prior_sd=0.1) if s.effect == effect else s for s in slots]
    assert unknown_gains(Space(tuple(known))) == []


def test_so_does_the_integral_of_a_loop(loaded):
    slots = loaded[0].space.slots
    gain = replace(slots[0], name="k_int", prior_sd=np.inf)
    free = unknown_gains(Space((*slots, gain)))
    assert len(free) == 3 and free[2] == len(slots)
    assert unknown_gains(Space((*slots, replace(gain, prior_sd=0.1)))) == []
