"""A servo without a low-pass jumps with its targets, and so does its logged effort.

Behind a quick low-pass the command is a saw, and the servo damps what the saw makes of
the speed: both are in the logged effort, and rows show neither.
"""

import numpy as np
import pytest
from support.plain_servo import ARM, problem_with

from envs.physics.quiet_mujoco import mujoco
from sysid.diagnosis.diagnose import problem_of
from sysid.diagnosis.replay.track import all_tracks
from sysid.drive import JointDrive, Nominal
from sysid.logs.log import make_log
from sysid.mechanism import model_mechanism

KP, KD, INERTIA, CUTOFF_HZ, DELAY_S = 36.0, 1.0, 0.5 * 0.15**2 + 0.00201, 15.0, 0.008
ROW_S, DT = 0.02, 0.0001


def behind_a_low_pass():
    """Equations of an axis behind a low-pass of 15 Hz, read 50 times in a second."""
    t_s = np.arange(0.0, 10.0, ROW_S)
    cmd = 0.5 * np.sin(2.0 * t_s) * np.cos(0.5 * t_s) + 0.2 * np.sin(7.0 * t_s)
    rows, late = round(ROW_S / DT), round(DELAY_S / DT)
    smooth = q = v = 0.0
    angle, torque = [], []
    for k in range(len(cmd) * rows):
        target = cmd[max(k - late, 0) // rows]
        drive = KP * (smooth - q) - KD * v
        if k % rows == 0:
            angle.append(q)
            torque.append(drive)
        smooth += (target - smooth) * -np.expm1(-2.0 * np.pi * CUTOFF_HZ * DT)
        v += DT * drive / INERTIA
        q += DT * v
    columns = dict(zip(("cmd", "pos", "tau"), (cmd, angle, torque), strict=True))
    columns = {f"{name}.servo": np.array(x) for name, x in columns.items()}
    log = make_log(("servo",), t_s, columns)
    path = {
        "lowpass_cutoff": {"cutoff_hz": Nominal(CUTOFF_HZ)},
        "transport_delay": {"delay_s": Nominal(DELAY_S)},
    }
    drive = JointDrive(Nominal(KP), Nominal(KD), effects=path)
    model = mujoco.MjModel.from_xml_string(ARM.replace('"0 1 0"', '"0 0 1"'))
    mechanism = model_mechanism(model, {"servo": drive})
    track = all_tracks([log], mechanism)[0]
    return problem_of(track, [log], mechanism, False)


def with_shares(problem, shares):
    """Coordinates at nominal with these shares of the ripple."""
    thetas = np.stack([problem.space.nominal] * len(shares))
    (ripple,) = (i for i, s in enumerate(problem.space.slots) if s.label == "ripple")
    thetas[:, ripple] = shares
    return thetas


@pytest.mark.parametrize(("shown", "lacks"), [(0.0, 1.0), (0.5, 0.0), (1.0, -1.0)])
def test_law_and_motion_agree_on_how_much_of_a_jump_an_effort_shows(shown, lacks):
    """Just before the target of its row, as a mean, or just behind that target."""
    problem = problem_with(row_s=0.01, shown=shown)
    shares = np.array([-1.0, 0.0, 1.0])
    thetas = with_shares(problem, shares)
    errors = np.sqrt(np.mean(problem.raw(thetas)[:, :, 30:-30] ** 2, (2, 3)))
    right = shares == lacks
    assert errors[right].max() < 0.03
    assert errors[~right].min() > 0.2


def test_of_a_saw_behind_a_low_pass_an_effort_lacks_a_share_too():
    """What the servo damps of the speed's ripple takes part of the command's away."""
    problem = behind_a_low_pass()
    raw = problem.raw(with_shares(problem, np.array([0.6, 1.0])))[:, 0, 30:-30]
    some, whole = np.sqrt(np.mean(raw**2, (1, 2)))
    assert some < 0.4 * whole
