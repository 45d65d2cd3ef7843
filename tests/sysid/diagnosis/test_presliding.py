"""Dry friction that gives 0.7 mrad before it slips is no hysteresis.

The record is integrated here, by none of the project's simulators.
"""

import numpy as np
import pytest

from envs.physics.quiet_mujoco import mujoco
from sysid.diagnosis.diagnose import diagnose
from sysid.diagnosis.search import presliding
from sysid.drive import JointDrive, Nominal
from sysid.logs.log import make_log
from sysid.mechanism import model_mechanism

RATE_HZ, DT, LENGTH_S = 100.0, 0.00025, 12.0
KP, KD, INERTIA, FRICTION_NM = 3.1, 0.11, 0.01325, 0.06
NOISE_RAD, AMPLITUDE_RAD = 3.5e-4, 0.04
AXIS = """
<mujoco><worldbody><body><joint name="servo" axis="0 0 1" armature="0.002"/>
<inertial pos="0.15 0 0" mass="0.5" diaginertia="1e-5 1e-5 1e-5"/>
</body></worldbody></mujoco>"""


def recorded(range_rad, seed=0):
    """A log of waves; friction is a spring whose end slips (Prandtl's element)."""
    rng = np.random.default_rng(seed)
    t_s = np.arange(round(LENGTH_S / DT)) * DT
    sent_s = np.floor(t_s * RATE_HZ + 1e-9) / RATE_HZ
    hz, phases = (0.4, 0.7, 1.1, 1.6), rng.uniform(0.0, 2.0 * np.pi, 4)
    waves = [
        np.sin(2 * np.pi * f * sent_s + p) for f, p in zip(hz, phases, strict=True)
    ]
    cmd, state = AMPLITUDE_RAD * np.sum(waves, 0), np.zeros((len(t_s), 2))
    q, v, pulled = cmd[0], 0.0, 0.0
    for k, target in enumerate(cmd):
        torque = KP * (target - q) - KD * v
        state[k] = q, torque
        pulled = np.clip(pulled + DT * v, -range_rad, range_rad)
        v += DT * (torque - FRICTION_NM * pulled / range_rad) / INERTIA
        q += DT * v
    every = round(1.0 / RATE_HZ / DT)
    pos, effort = (state[::every] + rng.normal(size=(1200, 2)) * (NOISE_RAD, 1e-3)).T
    columns = {"cmd.servo": cmd[::every], "pos.servo": pos, "tau.servo": effort}
    log = make_log(("servo",), t_s[::every], columns)
    gains = Nominal(3.0, tolerance=0.05), Nominal(0.1, tolerance=0.1)
    model = mujoco.MjModel.from_xml_string(AXIS)
    return [log], model_mechanism(model, {"servo": JointDrive(*gains)})


def named(record):
    return [cause.effect for cause in diagnose(*record).causes][:1]


def test_dry_friction_is_found():
    assert named(recorded(range_rad=7e-4)) == ["coulomb_friction"]


@pytest.mark.slow
def test_a_range_that_readings_show_is_a_hysteresis():
    assert named(recorded(range_rad=0.02)) == ["hysteresis"]


@pytest.mark.slow
def test_without_that_rule_it_is_not(monkeypatch):
    """Negative control."""
    monkeypatch.setattr(presliding, "RESOLVED", 0.0)
    assert named(recorded(range_rad=7e-4)) != ["coulomb_friction"]
