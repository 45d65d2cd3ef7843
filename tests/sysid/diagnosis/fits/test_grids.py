"""Grids of targets from which fits of a rounded command begin."""

from types import SimpleNamespace

import numpy as np
import pytest
from support.plain_servo import problem_with

from benchmarks.diagnosis.hidden.believed import believed
from benchmarks.diagnosis.hidden.recording import standard
from benchmarks.diagnosis.hidden.sampling import Noise, record
from benchmarks.diagnosis.hidden.stands import make_stand
from sysid.diagnosis.diagnose import problem_of
from sysid.diagnosis.fits.grids import chance_gain, grid_optima
from sysid.diagnosis.replay.track import all_tracks
from sysid.diagnosis.search.search import settled
from sysid.diagnosis.search.selection import THRESHOLD, threshold_of


@pytest.mark.parametrize("step_rad", [0.005, 0.03])
def test_a_grid_is_found_as_fine_as_noise_shows_it(step_rad):
    """The finer is a two-hundredth of the motion, and far above the noise."""
    rng = np.random.default_rng(3)
    stand = make_stand("pendulum", rng, lowpass_hz=15.0)
    once = standard(rng, stand.middle, stand.reach, 200.0, 6.0, 1)
    truth = stand.mechanism.with_effect(0, "command_quantization", step_rad=step_rad)
    log, mechanism = record(truth, once, Noise(), rng), believed(stand)
    track = all_tracks([log], mechanism)[0]
    problem, base = settled(problem_of(track, [log], mechanism, False))
    (i,) = problem.space.of("command_quantization")
    optima = problem.space.slots[i].scale * grid_optima(problem, base.fit.theta, i)
    assert np.min(np.abs(optima / step_rad - 1.0)) < 2e-3


def test_the_finer_a_grid_the_more_of_it_is_chance():
    """Ten times as fine, ten times as many were tried."""
    problem = problem_with()
    (i,) = problem.space.of("command_quantization")
    coarse = problem.space.nominal.copy()
    assert chance_gain(problem, coarse) == 0.0
    coarse[i] = 0.01
    fine = np.where(np.arange(coarse.size) == i, 0.001, coarse)
    more = chance_gain(problem, fine) - chance_gain(problem, coarse)
    assert more == pytest.approx(np.log(10.0), rel=0.01)
    model = SimpleNamespace(fit=SimpleNamespace(theta=fine))
    needed = threshold_of(problem, model, ["command_quantization"])
    assert needed == THRESHOLD + chance_gain(problem, fine)
    assert threshold_of(problem, model, ["deadband"]) == THRESHOLD
