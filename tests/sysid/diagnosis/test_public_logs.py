"""The diagnosis on public measurements, whose effects are known.

FINGERS_REAL_DATA names the folder that has `emps` and the others; see
docs/guides/logs.md.
"""

import os
from pathlib import Path

import numpy as np
import pytest

from benchmarks.diagnosis.public_logs.emps import load_emps
from benchmarks.diagnosis.public_logs.sts3215 import RAD_PER_COUNT, load_sts3215
from benchmarks.diagnosis.public_logs.xl330 import load_xl330
from envs.physics.quiet_mujoco import mujoco
from sysid.diagnosis.diagnose import examine
from sysid.drive import JointDrive, Nominal
from sysid.mechanism import model_mechanism

REAL = os.environ.get("FINGERS_REAL_DATA", "")
real = pytest.mark.skipif(not REAL, reason="FINGERS_REAL_DATA names no folder")

AXIS = """
<mujoco><option gravity="0 0 0"/><worldbody><body>
<joint name="axis" type="slide" axis="1 0 0"/>
<inertial pos="0 0 0" mass="95.11" diaginertia="1 1 1"/>
</body></worldbody></mujoco>"""


def axis():
    """The published reference model: its offset may be chosen freely."""
    drive = JointDrive(
        Nominal(160.18 * 243.45),
        Nominal(243.45),
        effects={
            "viscous_friction": {"damping_nms": Nominal(203.5, 0.1)},
            "coulomb_friction": {"torque_nm": Nominal(20.39, 0.1)},
            "asymmetric_friction": {"difference_nm": Nominal(-6.3, free=True)},
        },
        known="mechanics",
    )
    return model_mechanism(mujoco.MjModel.from_xml_string(AXIS), {"axis": drive})


def band(residual, kept, width):
    """Gaussian mean over the samples that count."""
    taps = np.exp(-0.5 * (np.arange(-12, 13) / width) ** 2)
    total = np.convolve(np.where(kept, residual, 0.0), taps, "same")
    return total / np.maximum(np.convolve(kept, taps, "same"), 1e-9)


@real
def test_emps():
    """Direction-dependent viscous friction; the pulses record tests it.

    Its errors depend on the band in which they are looked at. They are reported in that
    in which the published model leaves 2.15 N.
    """
    said, examined = examine(load_emps(Path(REAL) / "emps"), axis())
    assert said.verdict == "found"
    assert [c.effect for c in said.causes] == ["asymmetric_viscous"]
    difference = said.causes[0].parameters["difference_nms"]
    assert difference.low < -78.7 < difference.high
    found, problem = examined[0].search, examined[0].problem
    assert found is not None
    assert problem is not None
    kept = problem.valid[1][:, 1]
    residuals = [
        problem.raw(m.fold_theta[1:2], weigh=False)[0, 1][:, 1]
        for m in (found.base, found.best)
    ]
    for width in np.arange(0.3, 1.5, 0.01):
        rms = [np.sqrt(np.mean(band(r, kept, width)[kept] ** 2)) for r in residuals]
        if rms[0] <= 2.154:
            break
    print(f"held-out pulses record: {rms[0]:.3f} to {rms[1]:.3f} N")
    assert rms[0] == pytest.approx(2.154, rel=0.01)
    assert rms[1] <= 1.61


PENDULUM = """
<mujoco><worldbody><body><joint name="servo" axis="0 1 0" armature="0.002"/>
<inertial pos="0 0 -0.1" mass="0.49" diaginertia="1e-5 1e-5 1e-5"/>
</body></worldbody></mujoco>"""
STALL_NM = 0.6
"""About the torque of an XL330 at full duty."""
MANUAL = 4096 / (2.0 * np.pi * 885 * 128)
"""Duty per radian and unit of the gain register, as the manual has it: kp / 128."""


def servo(known, share, tolerance, effects):
    """The XL330; `share` of the manual's gain."""
    drive = JointDrive(
        Nominal(STALL_NM * MANUAL * share),
        Nominal(1e-6, 10.0),
        kp_setting="kp",
        effort="duty",
        effort_scale=Nominal(STALL_NM, tolerance, free=known != "controller"),
        effects=effects,
        known=known,
    )
    return model_mechanism(mujoco.MjModel.from_xml_string(PENDULUM), {"servo": drive})


@real
@pytest.mark.slow
@pytest.mark.timeout(3600)  # all records at once
def test_xl330_gain_is_half_of_the_manual():
    full = {"torque_limit": {"limit_nm": Nominal(STALL_NM, 0.01)}}
    logs = load_xl330(Path(REAL) / "bam_xl330" / "raw")
    said, _ = examine(logs, servo("controller", 1.0, 0.002, full))
    assert said.causes[0].effect == "stiffness"
    scale = said.causes[0].parameters["scale"]
    print(f"stiffness {scale.value:.4f} ({scale.low:.4f} to {scale.high:.4f})")
    assert scale.value == pytest.approx(0.50, abs=0.01)
    assert "thermal_derating" not in [c.effect for c in said.causes]


@real
@pytest.mark.slow
@pytest.mark.timeout(3600)  # all records at once
def test_xl330_load_friction_and_limit():
    """Every gain is predicted from the others: 109 to 54 mrad in closed loop."""
    free = {
        "viscous_friction": {"damping_nms": Nominal(0.02, 0.1, free=True)},
        "coulomb_friction": {"torque_nm": Nominal(0.01, 0.1, free=True)},
        "armature": {"inertia_kgm2": Nominal(0.0, 0.1, free=True)},
    }
    logs = load_xl330(Path(REAL) / "bam_xl330" / "raw")
    said, _ = examine(logs, servo("both", 0.5, 0.05, free))
    named = [c.effect for c in said.causes]
    assert {"torque_limit", "load_friction"} <= set(named)
    assert "thermal_derating" not in named
    gain = said.residual_gains["position"]
    print(f"{named}: {gain.heldout_rmse_before:.4f} to {gain.heldout_rmse_after:.4f}")
    assert gain.heldout_rmse_after <= 0.055 < 0.090 < gain.heldout_rmse_before


ARM = """
<mujoco><worldbody><body><joint name="motor"/>
<inertial pos="0 0 0" mass="0.1" diaginertia="1e-3 1e-3 1e-3"/>
</body></worldbody></mujoco>"""
SLOW_PATH = {
    "slew_limit": {"speed_rad_s": Nominal(400 * RAD_PER_COUNT, 0.3, free=True)},
    "transport_delay": {"delay_s": Nominal(0.1, 0.1, free=True)},
}


def sts3215(motor, known_to):
    """The servo as it answers in rest: 8 thousandths of its duty for a count."""
    drive = JointDrive(
        Nominal(0.008 / RAD_PER_COUNT, known_to),
        Nominal(1e-6, 10.0),
        effort="duty",
        effects=SLOW_PATH,
        known="controller",
    )
    arm = mujoco.MjModel.from_xml_string(ARM.replace('"motor"', f'"motor{motor}"'))
    return model_mechanism(arm, {f"motor{motor}": drive})


@real
@pytest.mark.parametrize("known_to", [0.05, 0.5])
def test_sts3215_deadband(known_to):
    """Ten rows a second under pulls that nobody measured: only the rests count.

    There duty is 8 thousandths for a count of error beyond the first; see the file.
    """
    file = Path(REAL) / "sts3215_backlash" / "logs" / "motor_telemetry_single.csv"
    log = load_sts3215(file, motors=["5"])
    said, _ = examine([log], sts3215(5, known_to))
    assert said.verdict == "found"
    assert [c.effect for c in said.causes] == ["deadband"]
    width = said.causes[0].parameters["half_width_rad"]
    print(f"half width {width.value:.5f} ({width.low:.5f} to {width.high:.5f}) rad")
    assert width.value == pytest.approx(RAD_PER_COUNT, rel=0.02)
    assert width.low < RAD_PER_COUNT < width.high


@real
@pytest.mark.parametrize(("motor", "alone"), [(1, False), (2, True)])
def test_sts3215_start_torque(motor, alone):
    """Two coupled servos: their duty jumps when an error is more than some counts."""
    file = Path(REAL) / "sts3215_backlash" / "logs" / "motor_telemetry_nocomp2.csv"
    said, _ = examine([load_sts3215(file, motors=[str(motor)])], sts3215(motor, 0.05))
    alike = {a.effect for a in said.alternatives if not a.distinguishable}
    named = {c.effect for c in said.causes} | alike
    print(f"motor {motor}: {said.verdict} {sorted(named)}")
    assert named == ({"start_torque"} if alone else {"stiffness", "start_torque"})
