"""What is lost of pushes is as large as the error of the angle shows."""

from dataclasses import replace

import numpy as np
import pytest
from support.plain_servo import problem_with

from sysid.diagnosis.fits.candidate import fit_models
from sysid.diagnosis.likelihood.repeats import Repeats
from sysid.diagnosis.replay.band import sample_rows
from sysid.diagnosis.simulated.output_error import OutputProblem, output_problem
from sysid.diagnosis.simulated.push_share import shown_pushes
from sysid.diagnosis.simulated.settled_output import settled_output

NOISE, LOST = 3e-4, 3e-3
"""Noise of the angle, and what may be lost of it by pushes [rad]."""


@pytest.fixture(scope="module")
def quiet() -> OutputProblem:
    """A servo whose effort was not logged, and on which nothing pushes."""
    problem = problem_with()
    problem.data.effort[:] = False
    output = output_problem(problem)
    assert output is not None
    return output


def may_lose(output: OutputProblem, where: np.ndarray) -> OutputProblem:
    """Pushes that were not read may move the joint at some steps of the grid."""
    kp = np.asarray(output.data.track.kp, float)
    pushed = where[:, None] * LOST * kp
    return replace(output, data=replace(output.data, pushed=pushed))


def noise(output: OutputProblem, size: np.ndarray | float) -> np.ndarray:
    white = np.random.default_rng(0).normal(size=output.fold.shape)
    return np.stack([0.0 * white, size * white])


def late(output: OutputProblem) -> np.ndarray:
    return np.arange(len(output.data.pushed)) > len(output.data.pushed) // 2


def second_half_again(output: OutputProblem) -> Repeats:
    """The second half of a record repeats the first."""
    half = len(output.fold) // 2
    rows = np.arange(len(output.fold))[:, None]
    twin = np.where(rows >= half, 0, -1), np.where(rows >= half, -half, 0).astype(float)
    return Repeats(*twin, rows % half, 0 * rows)


def test_what_no_error_shows_is_not_lost(quiet):
    unsure = may_lose(quiet, late(quiet))
    raw = noise(quiet, NOISE)
    shown = shown_pushes(unsure, raw)
    assert max(shown.push_shares) < 0.05
    weight = shown.with_noise(raw).weight
    assert weight == pytest.approx(quiet.with_noise(raw).weight, rel=0.05)


@pytest.mark.parametrize("share", [0.3, 1.0])
def test_a_share_is_found_where_the_error_grows_with_what_may_be_lost(quiet, share):
    where = late(quiet)
    rows = sample_rows(len(where))
    unsure = may_lose(quiet, where)
    raw = noise(quiet, np.hypot(NOISE, share * LOST * where[rows, None]))
    sampled, read = shown_pushes(unsure, raw).push_shares
    assert read == pytest.approx(share, rel=0.3)
    assert sampled == 0.0


def test_pushes_that_are_sampled_well_may_be_read_badly(quiet):
    """Early they change fast, late one is missing: only there the angle errs."""
    where, kp = late(quiet), float(np.min(np.asarray(quiet.data.track.kp)))
    rows = sample_rows(len(where))
    fast = np.where(where, 0.0, LOST * kp * (-1.0) ** np.arange(len(where)))
    track = replace(quiet.data.track, push=fast[:, None].astype(np.float32))
    output = replace(quiet, data=replace(quiet.data, track=track))
    unsure = may_lose(output, np.ones(len(where)))
    raw = noise(quiet, np.hypot(NOISE, LOST * where[rows, None]))
    sampled, read = shown_pushes(unsure, raw).push_shares
    assert read == pytest.approx(1.0, rel=0.3)
    assert sampled < 0.3


def test_what_repeats_share_is_lost_of_no_push(quiet):
    """A model errs alike in both runs; what a missing row takes it takes from one."""
    half = len(quiet.fold) // 2
    unsure = may_lose(quiet, np.ones(len(quiet.data.pushed)))
    raw = noise(quiet, NOISE)
    raw[1] += 0.02 * np.sin(0.3 * (np.arange(len(quiet.fold))[:, None] % half))
    again = replace(unsure, repeat=second_half_again(quiet))
    assert again.repeat
    assert max(shown_pushes(again, raw).push_shares) < 0.05
    assert max(shown_pushes(unsure, raw).push_shares) == 1.0


def test_repeats_of_which_none_counts_show_no_share(quiet):
    valid = quiet.valid.copy()
    valid[1, : len(quiet.fold) // 2] = False
    unsure = may_lose(quiet, np.ones(len(quiet.data.pushed)))
    unsure = replace(unsure, repeat=second_half_again(quiet), valid=valid)
    assert shown_pushes(unsure, noise(quiet, NOISE)).push_shares == (1.0, 1.0)


def test_without_pushes_there_is_no_share(quiet):
    assert shown_pushes(quiet, noise(quiet, NOISE)).push_shares == (1.0, 1.0)


def test_the_angle_of_a_quiet_joint_counts_whatever_may_be_lost(quiet):
    assert quiet.equations is not None
    base = fit_models(quiet.equations, [()], [quiet.space.nominal])[0]
    unsure = may_lose(quiet, np.ones(len(quiet.data.pushed)))
    settled, _ = settled_output(unsure, base)
    assert max(settled.push_shares) < 0.2
