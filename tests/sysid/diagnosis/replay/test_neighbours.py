"""Joints that may pull on another one, as far as records can show it."""

import numpy as np
import pytest

from benchmarks.diagnosis.hidden.believed import believed
from benchmarks.diagnosis.hidden.recording import standard
from benchmarks.diagnosis.hidden.sampling import Noise, record
from benchmarks.diagnosis.hidden.scaling import logged
from benchmarks.diagnosis.hidden.stands import make_stand
from sysid.diagnosis import diagnose
from sysid.diagnosis.replay.track import all_tracks


def drawn(moved):
    """A stand of four joints, of which some move, and a record of it."""
    rng = np.random.default_rng(3)
    stand = make_stand("finger", rng)
    reach = np.where(np.isin(np.arange(4), moved), stand.reach, 0.0)
    once = standard(rng, stand.middle, reach, 200.0, 4.0, 1)
    return stand, record(stand.mechanism, once, Noise(), rng)


@pytest.mark.parametrize(("moved", "near"), [((1, 2), [2]), ((1, 3), [1])])
def test_only_a_joint_that_is_driven_may_pull(moved, near):
    stand, log = drawn(moved)
    track = all_tracks([log], believed(stand))[1]
    assert list(track.neighbours) == [stand.names[k] for k in near]


@pytest.mark.parametrize(("moved", "asked"), [((1, 2), True), ((1,), False)])
def test_a_joint_may_pull_although_no_effort_is_logged(moved, asked, monkeypatch):
    stand, log = drawn(moved)
    log = logged(log, 1.0, effort=False)
    mechanism, problems = believed(stand, effort=False), []
    track = all_tracks([log], mechanism)[1]

    def search(problem):
        problems.append(problem)
        raise StopIteration

    monkeypatch.setattr(diagnose, "search", search)
    with pytest.raises(StopIteration):
        diagnose._examined(track, [log], mechanism)
    assert ("joint_coupling" in problems[0].space.effects) == asked
