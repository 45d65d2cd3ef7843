"""Joints that may pull on another one, as far as records can show it."""

import numpy as np
import pytest

from benchmarks.diagnosis.hidden.believed import believed
from benchmarks.diagnosis.hidden.recording import standard
from benchmarks.diagnosis.hidden.sampling import Noise, record
from benchmarks.diagnosis.hidden.stands import make_stand
from sysid.diagnosis.replay.track import all_tracks


@pytest.mark.parametrize(("moved", "near"), [((1, 2), [2]), ((1, 3), [1])])
def test_only_a_joint_that_is_driven_may_pull(moved, near):
    rng = np.random.default_rng(3)
    stand = make_stand("finger", rng)
    reach = np.where(np.isin(np.arange(4), moved), stand.reach, 0.0)
    once = standard(rng, stand.middle, reach, 200.0, 4.0, 1)
    log = record(stand.mechanism, once, Noise(), rng)
    track = all_tracks([log], believed(stand))[1]
    assert list(track.neighbours) == [stand.names[k] for k in near]
