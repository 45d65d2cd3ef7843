"""Paths of targets are walked once, and with nothing that nobody asks for."""

import jax.numpy as jnp
import numpy as np
import pytest
from support.plain_servo import problem_with

from sysid.diagnosis.fits import equations
from sysid.diagnosis.fits.equations import Evaluated, equation_errors
from sysid.diagnosis.fits.paths import command_paths
from sysid.diagnosis.replay.command import command_path


@pytest.fixture(scope="module")
def problem():
    return problem_with(row_s=0.004)


def candidates(problem, *changes):
    """Nominal coordinates, each with parameters of effects set to values."""
    rows = np.repeat(problem.space.nominal[None], len(changes), 0)
    for row, change in zip(rows, changes, strict=True):
        for effect, value in change.items():
            index = problem.space.of(effect)[0]
            row[index] = problem.space.slots[index].coordinate(value)
    return rows


SOME = [
    {"stiffness": 1.1},
    {"torque_slope_limit": 5.0, "lowpass_cutoff": 8.0},
    {"slew_limit": 2.0},
    {"acceleration_limit": 30.0},
    {"stiffness": 1.2},
]


def test_paths_are_those_of_all_targets(problem):
    track, dt = problem.data.track, problem.data.dt
    params, _ = problem.space.values(candidates(problem, *SOME))
    paths, which = command_paths(track, params, dt, {})
    assert len(paths) == 4 and which[0] == which[4]
    every = {e: {k: jnp.asarray(v) for k, v in p.items()} for e, p in params.items()}
    made = command_path(track.held, track.sent, every, dt)
    path, ripple, *ahead = np.moveaxis(paths[which], 0, -1)
    assert path == pytest.approx(np.asarray(made.path), abs=2e-6)
    assert ripple == pytest.approx(np.asarray(made.ripple), abs=2e-6)
    asks, expected = np.stack(ahead, 1)[..., 1], np.asarray(made.ahead)[..., 1]
    assert asks == pytest.approx(expected, abs=2e-6)
    assert np.abs(expected).max() > 1e-3


def test_errors_are_evaluated_once_for_a_track(problem, monkeypatch):
    asked, inner = [], equations.equation_error

    def counted(*args):
        asked.append(len(args[1]))
        return inner(*args)

    monkeypatch.setattr(equations, "equation_error", counted)
    rows, evaluated = candidates(problem, *SOME), Evaluated()
    first = equation_errors(problem.data, problem.space, rows, evaluated)
    again = equation_errors(problem.data, problem.space, rows[::-1], evaluated)
    assert len(asked) == 1 and np.array_equal(first[::-1], again)
    noisier = problem.with_noise(first[0].astype(float))
    assert noisier.evaluated is problem.evaluated
    equation_errors(noisier.data, noisier.space, rows, evaluated)
    assert len(asked) == 2
