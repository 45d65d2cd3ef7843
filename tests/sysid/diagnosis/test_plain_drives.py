"""Drives without low-pass or effort, and friction that could cancel a torque.

The records are integrated here, by none of the project's simulators.
"""

import numpy as np
import pytest

from envs.physics.quiet_mujoco import mujoco
from sysid.diagnosis.diagnose import diagnose, problem_of
from sysid.diagnosis.fits.candidate import fit_models, log_likelihood_gain
from sysid.diagnosis.replay.track import all_tracks
from sysid.diagnosis.search.settling import settled
from sysid.drive import JointDrive, Nominal
from sysid.logs.log import make_log
from sysid.mechanism import model_mechanism

ROW_S, DT = 0.02, 0.0005
KP, KD, COULOMB, WEIGHT, INERTIA = 24.0, 0.7, 0.08, 0.075, 0.01325
ARM = """
<mujoco><worldbody><body><joint name="servo" axis="0 1 0" armature="0.002"/>
<inertial pos="0 0 -0.15" mass="0.5" diaginertia="1e-5 1e-5 1e-5"/>
</body></worldbody></mujoco>"""
AXIS = """
<mujoco><option gravity="0 0 0"/><worldbody><body>
<joint name="joint" axis="0 0 1" armature="0.049"/>
<inertial pos="0 0 0" mass="0.36" diaginertia="0.001 0.001 0.001"/>
</body></worldbody></mujoco>"""


T_S = np.arange(0.0, 12.0, ROW_S)
SINES = 1.2 * np.sin(2.0 * T_S) * np.cos(0.5 * T_S) + 0.5 * np.sin(5.0 * T_S)
CHIRP = np.sin(0.6 * T_S**2)


def servo(late_s, *motions):
    """A servo that is read, and then sent its target, 50 times a second."""
    logs = []
    for cmd in motions or (SINES,):
        q = v = 0.0
        angle, rows, late = [], round(ROW_S / DT), round(late_s / DT)
        for k in range(len(cmd) * rows):
            if k % rows == 0:
                angle.append(q)
            target = cmd[(k - late) // rows] if k >= late else 0.0
            rest = KP * (target - q) - WEIGHT * 9.81 * np.sin(q)
            v = (v + DT * rest / INERTIA) / (1.0 + DT * KD / INERTIA)
            v = np.sign(v) * max(abs(v) - COULOMB * DT / INERTIA, 0.0)
            q += DT * v
        noise = 2e-4 * np.random.default_rng(1).normal(size=len(cmd))
        columns = {"cmd.servo": cmd, "pos.servo": angle + noise}
        logs.append(make_log(("servo",), T_S, columns))
    friction = {"coulomb_friction": {"torque_nm": Nominal(COULOMB)}}
    drive = JointDrive(Nominal(KP), Nominal(KD, 0.1), effort="none", effects=friction)
    mechanism = model_mechanism(mujoco.MjModel.from_xml_string(ARM), {"servo": drive})
    return diagnose(logs, mechanism)


def test_a_right_simulation_of_a_drive_without_low_pass_lacks_nothing():
    said = servo(0.0)
    assert (said.verdict, said.causes) == ("none", ())


def test_half_a_row_of_delay_is_named():
    """Late targets and late readings are alike: one of them, and its size."""
    check_late(servo(0.01))


def check_late(said):
    named = [c.effect for c in said.causes]
    assert named in (["transport_delay"], ["sensor_latency"])
    alike = {a.effect for a in said.alternatives if not a.distinguishable}
    assert alike <= {"transport_delay", "sensor_latency"}
    (found,) = said.causes[0].parameters.values()
    assert found.value == pytest.approx(0.01, abs=5e-4)


@pytest.mark.slow
def test_two_motions_name_it_too():
    """Equations alone put a low-pass in its place: each motion is a fold."""
    check_late(servo(0.01, SINES, CHIRP))
    said = servo(0.0, SINES, CHIRP)
    assert (said.verdict, said.causes) == ("none", ())


def axis_problem(share, coulomb):
    """An axis at five even speeds, whose motor current is logged."""
    rng, logs = np.random.default_rng(0), []
    for want in (0.1, 0.3, 0.7, 1.2, 2.0):
        t_s = np.arange(0.0, 3.0, 0.004)
        v = want * (1.0 - np.exp(-t_s / 0.1)) * (1.0 + 0.2 * np.sin(5.0 * t_s))
        q, a = np.cumsum(v) * 0.004, np.gradient(v, 0.004)
        # A motor that drives needs more by what friction takes of it.
        torque = (0.05 * a + coulomb + 0.25 * v) / (1.0 - share)
        current = torque / 4.1 + 0.015 * rng.normal(size=len(t_s))
        angle = q + 2e-6 * rng.normal(size=len(t_s))
        columns = {"cmd.joint": want * t_s, "pos.joint": angle, "cur.joint": current}
        logs.append(make_log(("joint",), t_s, columns))
    known = {"viscous_friction": {"damping_nms": Nominal(0.25)}}
    scale = Nominal(4.1, 0.05)
    drive = JointDrive(
        Nominal(100.0), Nominal(12.5), "", "cur", scale, known, "mechanics"
    )
    model = model_mechanism(mujoco.MjModel.from_xml_string(AXIS), {"joint": drive})
    track = all_tracks(logs, model)[0]
    return problem_of(track, logs, model, False)


@pytest.mark.parametrize(
    ("share", "coulomb", "right"),
    [(0.0, 0.6, "coulomb_friction"), (0.4, 0.0, "load_friction")],
)
def test_friction_that_could_cancel_the_torque_does_not_win(share, coulomb, right):
    """Negative control: where friction does grow with the torque it is named."""
    problem, base = settled(axis_problem(share, coulomb))
    names = ("coulomb_friction", "load_friction")
    models = []
    for name in names:
        starts = []
        for start in problem.space.starts(name):
            theta = base.fit.theta.copy()
            theta[list(start)] = list(start.values())
            starts.append(theta)
        fits = fit_models(problem, [(name,)] * len(starts), starts, rounds=10)
        models.append(min(fits, key=lambda m: m.fit.cost))
    gains = [log_likelihood_gain(base, m, problem.samples) for m in models]
    assert names[int(np.argmax(gains))] == right
    assert abs(gains[0] - gains[1]) > 3.0
