"""A servo with an arm, integrated here: by none of the project's simulators."""

import numpy as np

from envs.physics.quiet_mujoco import mujoco
from sysid.diagnosis.diagnose import problem_of
from sysid.diagnosis.replay.track import all_tracks
from sysid.drive import JointDrive, Nominal
from sysid.logs.log import make_log
from sysid.mechanism import model_mechanism

KP, KD, COULOMB, WEIGHT = 24.0, 0.7, 0.08, 0.5 * 0.15
INERTIA = 0.5 * 0.15**2 + 0.002
ARM = """
<mujoco><worldbody><body><joint name="servo" axis="0 1 0" armature="0.002"/>
<inertial pos="0 0 -0.15" mass="0.5" diaginertia="1e-5 1e-5 1e-5"/>
</body></worldbody></mujoco>"""


def still(t_s):
    """No push."""
    return 0.0 * t_s


def steps_taken(t_s):
    """Steps of 0.3 rad a second, as taken by a critically damped servo of 60 rad/s."""
    since = t_s % 1.0
    return 0.3 * np.floor(t_s) - 0.3 * (1.0 + 60.0 * since) * np.exp(-60.0 * since)


def servo(cmd, row_s, late_s=0.0, push=still, dt=0.0001):
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
        rest = drive - WEIGHT * 9.81 * np.sin(q) + push(k * dt)
        v = (v + dt * (rest + KD * v) / INERTIA) / (1.0 + dt * KD / INERTIA)
        v = np.sign(v) * max(abs(v) - COULOMB * dt / INERTIA, 0.0)
        q += dt * v
    return np.array(angle), np.array(torque)


def problem_with(
    late_s=0.0,
    known="both",
    row_s=0.02,
    push=still,
    lost_s=(0.0, 0.0),
    believed=None,
    shown=1.0,
    read=None,
):
    """The equations of one record of it; between two times rows are lost.

    `believed` are gains of which nothing is known, `shown` is the share of a target
    that the torque in its row has, `read` is what the log says of an angle.
    """
    t_s = np.arange(0.0, 8.0, row_s)
    cmd = 1.2 * np.sin(2.0 * t_s) * np.cos(0.5 * t_s) + 0.3 * np.sin(7.0 * t_s)
    angle, torque = servo(cmd, row_s, late_s, push)
    torque -= (1.0 - shown) * KP * np.diff(cmd, prepend=0.0)
    angle = read(angle) if read else angle
    columns = {"cmd.servo": cmd, "pos.servo": angle, "tau.servo": torque}
    kept = (t_s <= lost_s[0]) | (t_s >= lost_s[1])
    log = make_log(
        ("servo",), t_s[kept], {name: values[kept] for name, values in columns.items()}
    )
    friction = {"coulomb_friction": {"torque_nm": Nominal(COULOMB)}}
    kp, kd = believed or (KP, KD)
    gains = (Nominal(x, free=believed is not None) for x in (kp, kd))
    drive = JointDrive(*gains, effects=friction, known=known)
    mechanism = model_mechanism(mujoco.MjModel.from_xml_string(ARM), {"servo": drive})
    track = all_tracks([log], mechanism)[0]
    return problem_of(track, [log], mechanism, False)
