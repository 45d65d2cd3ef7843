"""Servos that follow with a lag whatever they carry: gains far above every load.

The records are integrated here, by none of the project's simulators.
"""

import numpy as np
import pytest
from support.plain_servo import ARM, WEIGHT

from envs.physics.quiet_mujoco import mujoco
from sysid.diagnosis.diagnose import diagnose
from sysid.drive import JointDrive, Nominal
from sysid.logs.log import make_log
from sysid.mechanism import model_mechanism

ROW_S, DT, LAG_S = 0.01, 0.0005, 0.08
STIFF = 1e4 * WEIGHT * 9.81
T_S = np.arange(0.0, 8.0, ROW_S)
CMD = np.sin(2 * T_S) * np.cos(0.5 * T_S) + 0.4 * np.sign(np.sin(0.9 * T_S))


def said_of(lag_s, late_s=0.0):
    """What is said of q̇ = (c(t − T) − q) / lag, where a lag of `LAG_S` is believed."""
    q, angle, rows, late = 0.0, [], round(ROW_S / DT), round(late_s / DT)
    for k in range(len(CMD) * rows):
        if k % rows == 0:
            angle.append(q)
        target = CMD[(k - late) // rows] if k >= late else 0.0
        q += DT * (target - q) / lag_s
    noise = 2e-4 * np.random.default_rng(1).normal(size=len(CMD))
    log = make_log(("servo",), T_S, {"cmd.servo": CMD, "pos.servo": angle + noise})
    drive = JointDrive(Nominal(STIFF), Nominal(STIFF * LAG_S), effort="none")
    model = mujoco.MjModel.from_xml_string(ARM)
    return diagnose([log], model_mechanism(model, {"servo": drive}))


def test_a_lag_that_is_right_lacks_nothing_whatever_the_load():
    assert said_of(LAG_S).verdict == "none"


@pytest.mark.parametrize(
    ("lag_s", "late_s", "effect", "parameter", "size"),
    [
        (1.3 * LAG_S, 0.0, "damping", "scale", 1.3),
        (LAG_S, 0.03, "transport_delay", "delay_s", 0.03),
    ],
)
def test_what_is_wrong_with_a_lag_is_named(lag_s, late_s, effect, parameter, size):
    """First, or beside another that moves the joint alike."""
    said = said_of(lag_s, late_s)
    (cause,) = said.causes
    alike = {a.effect for a in said.alternatives if not a.distinguishable}
    assert effect in {cause.effect, *alike}
    if cause.effect == effect:
        found = cause.parameters[parameter]
        assert found.value == pytest.approx(size, rel=0.03)
        assert found.low < size < found.high
