"""Mean targets of parts of a step: those of all targets, walked once."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from support.plain_servo import problem_with

from sysid.diagnosis.replay.command import command_path
from sysid.diagnosis.simulated import part_targets as module
from sysid.diagnosis.simulated.part_targets import part_targets

PARTS = 4


@pytest.fixture(scope="module")
def problem():
    return problem_with(row_s=0.004)


def params_of(problem, *changes):
    """Nominal parameters of candidates, each with some of its own."""
    rows = np.repeat(problem.space.nominal[None], len(changes), 0)
    params = problem.space.values(rows)[0]
    for k, change in enumerate(changes):
        for (effect, name), value in change.items():
            params[effect][name][k] = value
    return params


def means(problem, params, known):
    dt = problem.data.dt / PARTS
    found, which = part_targets(problem.data.track, params, dt, PARTS, known)
    return found[which]


def test_targets_left_out_change_nothing(problem):
    track, dt = problem.data.track, problem.data.dt
    params = params_of(
        problem,
        {},
        {("lowpass_cutoff", "cutoff_hz"): 8.0, ("transport_delay", "delay_s"): 0.0063},
        {("slew_limit", "speed_rad_s"): 2.0},
    )
    found = means(problem, params, {})
    ends = np.arange(1, PARTS + 1)[None, :, None, None]
    sent = PARTS * (np.asarray(track.sent)[:, None] + 1.0) - ends
    held = np.repeat(np.asarray(track.held)[:, None], PARTS, 1)
    every = (jnp.asarray(x.reshape(-1, *x.shape[2:]), "f4") for x in (held, sent))
    values = jax.tree.map(jnp.asarray, params)
    mean = np.asarray(command_path(*every, values, dt / PARTS).mean)
    expected = np.moveaxis(mean.reshape(-1, PARTS, *mean.shape[1:]), -1, 0)
    assert found == pytest.approx(expected, abs=2e-6)
    assert np.abs(found[1:] - found[0]).max((1, 2, 3)).min() > 0.01


def test_a_path_is_walked_once(problem, monkeypatch):
    walked, known = [], {}
    inner = module._walked

    def counted(track, params, *fixed):
        walked.append(len(params["lowpass_cutoff"]["cutoff_hz"]))
        return inner(track, params, *fixed)

    monkeypatch.setattr(module, "_walked", counted)
    first = means(problem, params_of(problem, {}, {}), known)
    stiff = params_of(problem, {})
    stiff["stiffness"] = {"scale": np.full(1, 1.3, np.float32)}  # behind the path
    assert np.array_equal(means(problem, stiff, known)[0], first[1])
    assert len(walked) == 1 and len(known) == 1
