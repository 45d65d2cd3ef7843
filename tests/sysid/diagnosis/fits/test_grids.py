"""Grids of targets from which fits of a rounded command begin."""

import numpy as np
import pytest

from benchmarks.diagnosis.hidden.believed import believed
from benchmarks.diagnosis.hidden.recording import standard
from benchmarks.diagnosis.hidden.sampling import Noise, record
from benchmarks.diagnosis.hidden.stands import make_stand
from sysid.diagnosis.diagnose import problem_of
from sysid.diagnosis.fits.grids import grid_optima
from sysid.diagnosis.replay.track import all_tracks
from sysid.diagnosis.search.search import settled


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
