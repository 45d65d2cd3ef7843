"""Joints that may pull on another one, as far as records can show it."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.diagnosis.hidden.believed import believed
from benchmarks.diagnosis.hidden.recording import standard
from benchmarks.diagnosis.hidden.sampling import Noise, record
from benchmarks.diagnosis.hidden.scaling import logged
from benchmarks.diagnosis.hidden.stands import make_stand
from sysid.diagnosis import diagnose
from sysid.diagnosis.replay.track import all_tracks
from sysid.drive import Nominal


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


def test_torques_of_other_joints_are_in_their_own_units():
    """Logged in 0.1 and 10 N·m; a joint's own scale is not that of its neighbours."""
    stand, log = drawn((1, 2))
    mechanism = believed(stand)
    scales = dict(zip(stand.names, (1.0, 0.1, 10.0, 1.0), strict=True))
    units = {f"tau.{name}": scale for name, scale in scales.items()}
    columns = {c: v / units.get(c, 1.0) for c, v in log.columns.items()}
    drives = {
        name: replace(drive, effort_scale=Nominal(scales[name]))
        for name, drive in mechanism.drives.items()
    }
    in_nm = all_tracks([log], mechanism)[1].track
    log, mechanism = replace(log, columns=columns), replace(mechanism, drives=drives)
    scaled = all_tracks([log], mechanism)[1].track
    for field in ("effort", "others_nm", "other_nm"):
        true = np.asarray(getattr(in_nm, field))
        assert np.ptp(true) > 0.0, field
        np.testing.assert_allclose(
            getattr(scaled, field), true, atol=1e-4 * np.abs(true).max()
        )
