"""The judge's simulation against a servo that is integrated here, and the judge."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from envs.physics.quiet_mujoco import mujoco
from sysid.diagnosis.diagnose import problem_of
from sysid.diagnosis.replay.track import all_tracks
from sysid.diagnosis.search.closed_loop import sharp_angle, simulated
from sysid.diagnosis.search.judge import Judge
from sysid.drive import JointDrive, Nominal
from sysid.logs.log import make_log
from sysid.mechanism import model_mechanism

KP, KD, COULOMB, WEIGHT = 24.0, 0.7, 0.08, 0.5 * 0.15
INERTIA = 0.5 * 0.15**2 + 0.002
ARM = """
<mujoco><worldbody><body><joint name="servo" axis="0 1 0" armature="0.002"/>
<inertial pos="0 0 -0.15" mass="0.5" diaginertia="1e-5 1e-5 1e-5"/>
</body></worldbody></mujoco>"""


def servo(cmd, row_s, late_s=0.0, dt=0.0005):
    """Angles and torques of a servo without low-pass: read, then the target is sent."""
    q = v = 0.0
    angle, torque = [], []
    rows, late = round(row_s / dt), round(late_s / dt)
    for k in range(len(cmd) * rows):
        target = cmd[max(k - late, 0) // rows] if k >= late else 0.0
        drive = KP * (target - q) - KD * v
        if k % rows == 0:
            angle.append(q)
            torque.append(drive)
        rest = drive - WEIGHT * 9.81 * np.sin(q)
        v = (v + dt * (rest + KD * v) / INERTIA) / (1.0 + dt * KD / INERTIA)
        v = np.sign(v) * max(abs(v) - COULOMB * dt / INERTIA, 0.0)
        q += dt * v
    return np.array(angle), np.array(torque)


def problem_with(late_s=0.0, known="both", row_s=0.02):
    t_s = np.arange(0.0, 8.0, row_s)
    cmd = 1.2 * np.sin(2.0 * t_s) * np.cos(0.5 * t_s) + 0.3 * np.sin(7.0 * t_s)
    angle, torque = servo(cmd, row_s, late_s)
    columns = {"cmd.servo": cmd, "pos.servo": angle, "tau.servo": torque}
    log = make_log(("servo",), t_s, columns)
    friction = {"coulomb_friction": {"torque_nm": Nominal(COULOMB)}}
    drive = JointDrive(Nominal(KP), Nominal(KD), effects=friction, known=known)
    mechanism = model_mechanism(mujoco.MjModel.from_xml_string(ARM), {"servo": drive})
    track = all_tracks([log], mechanism)[0]
    return problem_of(track, [log], mechanism, False)


def error(problem, changes=()):
    """Deviation of the simulated angle with some parameters changed [rad]."""
    theta, changes = problem.space.nominal.copy(), dict(changes)
    for i, slot in enumerate(problem.space.slots):
        if slot.label in changes:
            theta[i] = slot.coordinate(changes[slot.label])
    angle = simulated(problem, theta[None])[0]
    away = sharp_angle(problem.data.track, problem.data.dt) - angle
    return float(np.sqrt(np.mean(away[30:-30] ** 2)))


def test_targets_alone_lead_to_the_measured_angles():
    assert error(problem_with()) < 1e-3
    late = problem_with(0.01)
    assert error(late) > 5e-3  # half a row without a name
    assert error(late, {"transport_delay.delay_s": 0.01}) < 1e-3
    assert error(late, {"transport_delay.delay_s": 0.02}) > 5e-3


def test_the_logged_effort_drives_where_the_law_is_unknown():
    """A servo that nobody knows: its gains do not enter, friction does."""
    problem = problem_with(known="mechanics", row_s=0.002)
    right = error(problem)
    assert error(problem, {"stiffness.scale": 2.0}) == pytest.approx(right, rel=1e-4)
    assert error(problem, {"coulomb_friction.torque_nm": 3.0 * COULOMB}) > 2.0 * right
    assert error(problem, {"load_friction.drive_share": 0.98}) > 2.0 * right


def judged(problem, before, after):
    """What the judge says of two models with given errors of the angle."""
    judge = Judge(problem)
    shape = problem.data.valid.shape
    models = [SimpleNamespace(name=name) for name in ("smaller", "larger")]
    judge.bounded[id(models[0])] = (models[0], models[0])
    for model, size in zip(models, (before, after), strict=True):
        rng = np.random.default_rng(3)
        judge.errors[id(model)] = (model, size * rng.normal(size=shape))
    return judge.confirms(*models)


@pytest.fixture(scope="module")
def problem():
    return problem_with()


def test_only_what_comes_nearer_is_confirmed(problem):
    assert judged(problem, 0.02, 0.01)
    assert not judged(problem, 0.01, 0.01)
    assert not judged(problem, 0.01, 0.02)
    assert not judged(problem, 0.01, np.inf)  # a simulation that blows up


def test_where_nothing_can_be_simulated_equations_decide(problem):
    """Unknown forces push the joint: no simulation of it says anything."""
    assert judged(replace(problem, known="controller"), 0.01, 0.02)
