"""The size of a joint's torques, by which coefficients of torques are searched."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.diagnosis.hidden.believed import believed
from benchmarks.diagnosis.hidden.recording import standard
from benchmarks.diagnosis.hidden.sampling import Noise, record
from benchmarks.diagnosis.hidden.scaling import logged
from benchmarks.diagnosis.hidden.stands import make_stand
from sysid.diagnosis.replay.track import all_tracks
from sysid.drive import Nominal


@pytest.fixture(scope="module")
def drawn():
    """A stand of one joint, and a record of it with its effort."""
    rng = np.random.default_rng(3)
    stand = make_stand("axis", rng)
    once = standard(rng, stand.middle, stand.reach, 200.0, 4.0, 1)
    return stand, record(stand.mechanism, once, Noise(), rng)


def scale_nm(drawn, limit_nm, effort):
    """Torque scale of the joint, whose drive has this nominal limit."""
    stand, log = drawn
    mechanism, name = believed(stand, effort=effort), stand.names[0]
    drive = mechanism.drives[name]
    limited = {**drive.effects, "torque_limit": {"limit_nm": Nominal(limit_nm)}}
    drives = {name: replace(drive, effects=limited)}
    log = logged(log, 1.0, effort=effort)
    return all_tracks([log], replace(mechanism, drives=drives))[0].torque_scale


def test_a_servo_whose_effort_is_not_logged_gives_no_more_than_its_limit(drawn):
    """kp times the error of a target that is far away is many times that."""
    asked = scale_nm(drawn, np.inf, effort=False)
    assert scale_nm(drawn, 0.1 * asked, effort=False) == pytest.approx(0.1 * asked)
    assert scale_nm(drawn, 2.0 * asked, effort=False) == pytest.approx(asked)


def test_a_logged_effort_is_as_large_as_it_is(drawn):
    given = scale_nm(drawn, np.inf, effort=True)
    assert scale_nm(drawn, 0.1 * given, effort=True) == given
