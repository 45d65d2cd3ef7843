"""How late a servo may take its targets: no later than a record shows."""

from dataclasses import replace

import numpy as np
import pytest
from support.plain_servo import problem_with

from sysid.diagnosis.replay.band import EVERY
from sysid.diagnosis.replay.timing_uncertainty import CYCLE_S
from sysid.diagnosis.simulated.output_error import output_error
from sysid.diagnosis.simulated.taken import shown_lateness

NOISE = 1e-4


def left(late_s, seed=0):
    """What is left of an angle that is late by chance, its speed, and where."""
    rng = np.random.default_rng(seed)
    speed = np.abs(5.0 * np.sin(np.arange(2000) / 30.0))[:, None] ** 3
    error = NOISE * rng.normal(size=speed.shape)
    error += late_s * speed * rng.normal(size=speed.shape)
    return error, NOISE, speed, np.ones(speed.shape, bool)


@pytest.mark.parametrize("late_s", [5e-5, 1.5e-4])
def test_lateness_is_what_errors_have_of_the_speed(late_s):
    assert shown_lateness(*left(late_s)) == pytest.approx(late_s, rel=0.1)


def test_it_is_none_where_moving_angles_err_as_those_at_rest():
    assert shown_lateness(*left(0.0)) < 1e-5


def test_it_is_no_more_than_a_cycle():
    assert shown_lateness(*left(1e-2)) == CYCLE_S
    error, size, speed, counts = left(0.0)
    assert shown_lateness(np.full_like(error, np.inf), size, speed, counts) == CYCLE_S
    assert shown_lateness(error, size, 0.0 * speed, counts) == CYCLE_S


def twice(output, error):
    """The angle's error of two runs of a motion, of which the second repeats."""
    half = len(error) // 2
    piece = np.where(np.arange(len(error)) >= half, 0, -1)[:, None]
    lag = np.full(piece.shape, -float(half))
    repeat = replace(output.repeat, piece=piece, lag=lag)
    data = replace(output.data, noise=(1e-6, 0.0))
    return replace(output, repeat=repeat, data=data).with_noise(
        np.stack([0.0 * error, error])
    )


def test_an_angle_at_speed_weighs_as_repeats_show_it():
    output = output_error(problem_with(row_s=0.005))
    assert output is not None
    rng = np.random.default_rng(1)
    error = 1e-5 * rng.normal(size=output.fold.shape)
    speed = np.abs(np.asarray(output.data.track.vel, float))[::EVERY][: len(error)]
    alike, scattered = (
        twice(output, error + late_s * speed * rng.normal(size=error.shape))
        for late_s in (0.0, 2.0 * CYCLE_S)
    )
    assert alike.late_s < 0.1 * CYCLE_S
    assert np.all(alike.weight[1] > 0.5)
    assert scattered.late_s == CYCLE_S
    assert scattered.weight[1].min() < 0.6
