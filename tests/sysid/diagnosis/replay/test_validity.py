"""Where a simulation may begin anew behind targets that were lost."""

import math
from dataclasses import replace

import numpy as np
import pytest

from sysid.diagnosis.replay.validity import begins_anew
from sysid.drive import Cascade, JointDrive, Nominal

STEP_S = 0.005
PATH = {
    "transport_delay": {"delay_s": Nominal(0.004)},
    "lowpass_cutoff": {"cutoff_hz": Nominal(15.0)},
}
TWO_GAINS = JointDrive(kp=Nominal(20.0), kd=Nominal(0.5))
LOOPS = JointDrive(cascade=Cascade(Nominal(10.0), Nominal(0.5), Nominal(3.0), 2.0))


@pytest.mark.parametrize("drive", [TWO_GAINS, LOOPS], ids=["two gains", "loops"])
def test_it_begins_anew_until_its_command_is_known(drive):
    """Targets are lost behind which a step has been: the low-pass forgets it first.

    A servo of two gains went on with the command that lacked it, and at its limit
    was elsewhere for seconds.
    """
    resumed = np.zeros((100, 1))
    resumed[[30, 60]] = 1.0
    slow = replace(drive, effects=PATH)
    begins = np.flatnonzero(begins_anew(slow, resumed, STEP_S))
    rows = math.ceil((0.004 + 4.6 / (2.0 * math.pi * 15.0)) / STEP_S)
    assert begins.tolist() == [k + i for k in (30, 60) for i in range(rows + 1)]


def test_a_target_that_acts_at_once_is_known_at_once():
    resumed = np.zeros((100, 1))
    resumed[[30, 60]] = 1.0
    assert np.array_equal(begins_anew(TWO_GAINS, resumed, STEP_S), resumed > 0.0)
