"""The output error: which records it decides, its noise, and how candidates compare."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from support.plain_servo import problem_with

from sysid.diagnosis.fits.candidate import fit_models, likelihood_gap, task_of
from sysid.diagnosis.likelihood.whitening import Noise
from sysid.diagnosis.measured.resampling import SMOOTH_STEPS, smoothed
from sysid.diagnosis.replay.band import sample_rows
from sysid.diagnosis.replay.timing_uncertainty import push_uncertainty
from sysid.diagnosis.simulated.closed_loop import SUBSTEP_S
from sysid.diagnosis.simulated.output_error import output_problem


def silent(late_s=0.0):
    """The equations of a servo whose effort was not logged."""
    problem = problem_with(late_s)
    problem.data.effort[:] = False
    return problem


def test_it_decides_where_no_effort_was_logged():
    assert output_problem(problem_with()) is None
    assert output_problem(problem_with(known="mechanics")) is None
    assert output_problem(silent()).equations is not None


def test_its_residual_is_the_error_of_the_angle():
    output = output_problem(silent(0.01))
    raw = output.raw(output.space.nominal[None])[0]
    assert np.all(raw[0] == 0.0)
    size = float(np.sqrt(np.mean(raw[1][output.valid[1]] ** 2)))
    assert 5e-3 < size < 0.05
    assert output.channel_counts()[0] == 0
    assert output.samples == int(output.valid[1].sum())


def test_what_an_error_leaves_is_noise_but_never_less_than_the_readings():
    output = output_problem(silent())
    rng = np.random.default_rng(0)
    left = np.stack([np.zeros(output.fold.shape), rng.normal(size=output.fold.shape)])
    assert output.with_remaining(3.0 * left).noise[1].deviation == pytest.approx(
        3.0, rel=0.5
    )
    least = output.with_remaining(0.0 * left).noise[1].deviation
    assert least >= 0.5 * output.data.noise[0]


def test_noise_without_repeats_is_that_of_the_smoothed_angle():
    """Of readings of noise 1; the angle's error has passed no other band."""
    output = output_problem(silent())
    rows = sample_rows(len(output.data.track.cmd))
    white = np.random.default_rng(0).normal(size=rows[-1] + 9)
    noise = smoothed(white, SMOOTH_STEPS)[rows]
    slow = 20.0 * np.sin(0.5 * np.arange(len(rows)) * 4 * output.data.dt)
    raw = np.stack([0.0 * output.valid[1], (noise + slow)[:, None]])
    found = output.with_noise(raw).noise[1].deviation
    assert found == pytest.approx(float(np.std(noise)), rel=0.15)
    read = replace(output, data=replace(output.data, noise=(1.0, 0.0)))
    least = read.with_remaining(0.0 * raw).noise[1].deviation
    assert least == pytest.approx(float(np.std(noise)), rel=0.15)


def test_where_others_push_faster_than_is_sampled_the_angle_counts_less():
    output = output_problem(silent())
    track, dt = output.data.track, output.data.dt
    push = np.zeros(np.shape(track.push))
    half = len(push) // 2
    push[half::2] = 0.01 * float(np.min(np.asarray(track.kp)))
    unsure = push_uncertainty(push, np.ones(push.shape, bool), dt)
    pushed = replace(output, data=replace(output.data, pushed=unsure))
    rng = np.random.default_rng(0)
    raw = np.stack([0.0 * output.valid[1], rng.normal(0.0, 3e-4, output.fold.shape)])
    share = pushed.with_noise(raw).weight[1] / output.with_noise(raw).weight[1]
    first = len(share) // 2
    assert share[: first - 4] == pytest.approx(1.0, rel=0.1)
    assert np.all(share[first + 4 :] < 0.5)


def test_a_fit_to_the_angle_finds_a_delay_that_equations_only_guess():
    output = output_problem(silent(0.01))
    output = output.with_remaining(np.full((2, *output.fold.shape), 3e-4))
    index = output.space.of("transport_delay")[0]
    start = output.space.nominal.copy()
    start[index] = 0.012 / output.space.slots[index].scale
    found = fit_models(output, [("transport_delay",)], [start])[0]
    delay_s = float(output.space.slots[index].value(found.fit.theta[index]))
    assert delay_s == pytest.approx(0.01, abs=2e-4)


def at_its_limit(problem, late_s):
    """Coordinates of a servo that a target makes push as hard as it can, later."""
    theta = problem.space.nominal.copy()
    limit, late = (problem.space.of(e)[0] for e in ("torque_limit", "transport_delay"))
    theta[limit] = problem.space.slots[limit].coordinate(0.5)
    theta[late] = late_s / problem.space.slots[late].scale
    return theta


def test_a_slope_over_a_delay_is_of_whole_steps_of_the_simulation():
    """At its limit a servo does not see when within a substep a target came."""
    output = output_problem(silent())
    late, sizes = output.space.of("transport_delay")[0], []
    for share in (0.05, 0.3, 0.55, 0.8):
        start = at_its_limit(output, 0.01 + share * SUBSTEP_S)
        ahead, step = start.copy(), task_of(output, ("transport_delay",), start).steps
        ahead[late] += step[late]
        before, after = output.residual(np.stack([start, ahead]))
        sizes.append(np.linalg.norm(after - before) / max(step[late], 1e-12))
    assert sizes == pytest.approx(np.mean(sizes) + np.zeros(4), rel=0.1)
    assert sizes[0] > 0.1


def candidate(score, tau=1.0, samples=100):
    variance = max(1.0, tau * score / samples)
    return SimpleNamespace(
        score=score, correlation=tau, noise_cost=0.0, variance=lambda _: variance
    )


def test_candidates_that_are_alike_stay_so_however_much_both_explain():
    """A per cent of the error is half a sample's worth of evidence per hundred."""
    close = likelihood_gap(candidate(1010.0), candidate(1000.0), 100)
    assert close == pytest.approx(50.0 * np.log(1.01))
    assert likelihood_gap(candidate(1000.0), candidate(1010.0), 100) == pytest.approx(
        -close
    )
    assert likelihood_gap(candidate(2000.0), candidate(1000.0), 100) > 30.0
    # Known noise is the least variance: ratios of smaller errors say nothing.
    assert likelihood_gap(candidate(20.0), candidate(10.0), 100) == pytest.approx(
        50.0 * np.log(1.1)
    )
    assert likelihood_gap(candidate(np.inf), candidate(1.0), 100) == np.inf


def test_correlated_errors_count_less():
    once = likelihood_gap(candidate(2000.0), candidate(1000.0), 100)
    assert (
        likelihood_gap(candidate(2000.0, 10.0), candidate(1000.0, 10.0), 100)
        < 0.2 * once
    )


def test_noise_is_white_without_repeats():
    output = output_problem(silent())
    noisy = output.with_noise(output.raw(output.space.nominal[None])[0])
    assert isinstance(noisy.noise[1], Noise)
    assert len(noisy.noise[1].a) == 0
    assert noisy.noise[1].deviation > 0.0
