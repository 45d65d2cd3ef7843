"""Loaders of the gallery's second half, on small files that stand for the real ones."""

import io

import numpy as np
import pytest
import scipy.io

from benchmarks.diagnosis.gallery.__main__ import RECORDS
from envs.physics.quiet_mujoco import mujoco


def csv(names, rows):
    lines = [",".join(names), *(",".join(map(str, row)) for row in rows)]
    return "\n".join(lines).encode()


def made(name, files):
    """What a record makes of files that are found by the ends of their paths."""

    def read(path):
        (found,) = [text for end, text in files.items() if path.endswith(end)]
        return found

    return RECORDS[name].made(read)


def held_nm(model, q):
    """Torques that hold a mechanism still."""
    data = mujoco.MjData(model)
    data.qpos[:] = q
    mujoco.mj_inverse(model, data)
    return data.qfrc_inverse


def arm_urdf(joints, dynamics=""):
    """Links of 1 kg, 0.1 m out, on axes along y, each 0.2 m behind the one before."""
    links = ['<link name="base_link"/>']
    for k, joint in enumerate(joints, 1):
        before = f"link{k - 1}" if k > 1 else "base_link"
        links.append(
            f'<link name="link{k}"><inertial><origin xyz="0.1 0 0"/><mass value="1"/>'
            '<inertia ixx="1e-3" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/>'
            f'</inertial></link><joint name="{joint}" type="revolute">'
            f'<origin xyz="0.2 0 0"/><parent link="{before}"/><child link="link{k}"/>'
            f'<axis xyz="0 1 0"/>{dynamics}</joint>'
        )
    return f'<robot name="arm">{"".join(links)}</robot>'.encode()


def airbot(damping="0.02"):
    joints = [f"joint{k}" for k in range(1, 7)]
    friction = f'<dynamics damping="{damping}" friction="0.3"/>'
    rows = np.arange(18.0).reshape(3, 6) / 10
    return made(
        "airbot_payload",
        {
            "q_real_loaded.csv": csv([f"q{k}" for k in range(6)], rows),
            "tau_real_loaded.csv": csv([f"tau{k}" for k in range(1, 7)], -rows),
            "airbot_play_v3_0_gripper.urdf": arm_urdf(joints),
            "updated_robot.urdf": arm_urdf(joints, friction),
        },
    )


def test_airbot_carries_its_load_at_the_tip():
    (log,), mechanism = airbot()
    assert log.t_s.tolist() == [0.0, 0.01, 0.02]
    assert log.columns["pos.joint2"].tolist() == [0.1, 0.7, 1.3]
    assert log.columns["tau.joint6"].tolist() == [-0.5, -1.1, -1.7]
    model = mechanism.model
    tip = model.body("payload")
    assert model.body("link6").id == tip.parentid[0]
    assert not tip.pos.any()
    assert tip.mass[0] < 1e-3
    effects = mechanism.drives["joint3"].effects
    assert effects["coulomb_friction"]["torque_nm"].value == 0.3
    assert effects["viscous_friction"]["damping_nms"].value == 0.02


def test_airbot_has_no_friction_that_pushes():
    _, mechanism = airbot(damping="-0.3")
    assert set(mechanism.drives["joint2"].effects) == {"coulomb_friction"}


def test_tx40_turns_motors_into_joints():
    """Power is the same on both sides of the gears, also where two motors share."""
    joints = [f"joint_{k}" for k in range(1, 7)]
    rng = np.random.default_rng(0)
    motors, torques = rng.normal(size=(2, 4, 6))
    (log,), mechanism = made(
        "tx40_friction",
        {
            "pos_read_data.csv": csv(joints, motors),
            "curr_data.csv": csv(joints, torques),
            "tx40_mdh_modified.urdf": arm_urdf(joints),
        },
    )
    q, tau = (np.stack([log.columns[f"{c}.{j}"] for j in joints], 1)
              for c in ("pos", "tau"))  # fmt: skip
    turns, moved = np.diff(motors, axis=0), np.diff(q, axis=0)
    assert np.sum(moved * tau[1:], 1) == pytest.approx(np.sum(turns * torques[1:], 1))
    assert moved[:, 0] == pytest.approx(turns[:, 0] / 32.0)
    assert moved[:, 5] == pytest.approx(turns[:, 5] / 32.0 - turns[:, 4] / 45.0)
    assert log.t_s[-1] == pytest.approx(3 * 0.0002)
    rotor = mechanism.drives["joint_3"].effects["armature"]["inertia_kgm2"]
    assert (rotor.value, rotor.free) == (0.0988, True)


def kr300():
    rest = {
        "time_cont": np.arange(3) * 0.004,
        "act_pos_mot_deg": np.arange(18.0).reshape(6, 3),
        "act_torque_abs_nm": np.ones((6, 3)),
    }
    file = io.BytesIO()
    scipy.io.savemat(file, {"rec": rest})
    return made("kr300_friction", {"data.mat": file.getvalue()})


def test_kr300_is_read_behind_its_gears():
    logs, _ = kr300()
    assert len(logs) == 3
    columns = logs[0].columns
    assert columns["pos.axis1"] == pytest.approx(np.deg2rad([0.0, 1.0, 2.0]))
    assert columns["pos.axis2"][0] == pytest.approx(np.deg2rad(3.0) - np.pi / 2)
    assert columns["tau.axis1"] == pytest.approx(1798 / 7)


def test_kr300_weighs_what_its_authors_say():
    """`gravload_150.m`, with the wrist straight; 9.81 of it."""
    model = kr300()[1].model
    for q2, q3 in ((-1.3, 0.4), (-0.7, -0.2), (-2.0, 1.0)):
        both = q2 + q3 - np.pi / 2  # their third angle lacks the link's offset
        third = -(2301.3000396 + 536.2277454) * np.cos(both) + 118.2739707 * np.sin(
            both
        )
        second = third - 5305.6347102 * np.cos(q2) - 3.3267672 * np.sin(q2)
        found = held_nm(model, [0.3, q2, q3, 0.0, 0.0, 0.0])
        assert found[1:3] == pytest.approx([second, third], abs=0.5)
        assert found[0] == pytest.approx(0.0, abs=1e-6)


def test_kr300_is_held_up_by_its_spring():
    """It pushes towards the upright, where it has no lever."""
    columns = kr300()[0][0].columns
    angle, push = np.rad2deg(columns["pos.axis2"]), columns["ext.axis2"]
    assert np.all((angle > -95.0) & (push < 0.0))
    assert np.all(np.diff(push) < 0.0)


MATLAB = """
Il=[{inertias}];
m =[{masses}];
CoM_l =[ {coms}]';
"""


def test_franka_stands_as_its_table_says():
    inertias = ";\n".join(["1e-2, 0, 0, 1e-2, 0, 2e-2"] * 7)
    masses = "\n".join(["1.5"] * 7)
    coms = ";\n".join(["0, 0, -0.1"] * 7)
    text = MATLAB.format(inertias=inertias, masses=masses, coms=coms).encode()
    numbers = "\n".join(str(k / 10) for k in range(14)).encode()
    (log,), mechanism = made(
        "franka_friction",
        {
            "_positions.txt": numbers,
            "_torques.txt": numbers,
            "_time.txt": b"0\n0.001",
            "DynPars2VREP.m": text,
        },
    )
    assert log.columns["pos.joint3"].tolist() == [0.2, 0.9]
    assert log.columns["tau.joint7"].tolist() == [0.6, 1.3]
    model = mechanism.model
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert model.body_subtreemass[1] == pytest.approx(7 * 1.5)
    assert data.xpos[-1] == pytest.approx([0.088, 0.0, 0.333 + 0.316 + 0.384])
    assert data.xmat[-1].reshape(3, 3)[:, 2] == pytest.approx([0.0, 0.0, -1.0])
    assert data.xipos[-1][2] == pytest.approx(1.033 + 0.1)


PENDULUM = ("time", "pos_meas1", "pos_meas2", "tau_meas1", "tau_meas2")
ROWS = [(0.0, 0.1, 0.2, 0.3, 0.4), (0.002, 0.5, 0.6, 0.7, 0.8)]


def test_the_cloud_pendulum_hangs_on_points():
    (log,), mechanism = made(
        "cloud_pendulum", {"sysid_exp_data_30s.csv": csv(PENDULUM, ROWS)}
    )
    assert log.columns["pos.elbow"].tolist() == [0.2, 0.6]
    assert log.columns["tau.shoulder"].tolist() == [0.3, 0.7]
    elbow = 9.81 * 0.064 * 0.048 * np.sin(1.1)
    shoulder = 9.81 * (0.131 * 0.046 + 0.064 * 0.05) * np.sin(0.4) + elbow
    found = held_nm(mechanism.model, [0.4, 0.7])
    assert found == pytest.approx([shoulder, elbow], rel=1e-6)


PARAMETERS = b"""
{I1: 0.03, I2: 0.05, Ir: 1.0e-4, gr: 6.0, l1: 0.2, l2: 0.3,
 m1: 0.5, m2: 0.6, r1: 0.2, r2: 0.25, b1: 9.0, cf1: 9.0}
"""


def test_the_double_pendulum_has_its_inertias_about_the_axes():
    logs, mechanism = made(
        "dfki_double_pendulum",
        {"trajectory.csv": csv(PENDULUM, ROWS), "model_parameters.yml": PARAMETERS},
    )
    assert len(logs) == 10
    assert logs[0].columns["tau.elbow"].tolist() == [0.4, 0.8]
    model = mechanism.model
    data, mass = mujoco.MjData(model), np.zeros((2, 2))
    mujoco.mj_forward(model, data)
    mujoco.mj_fullM(model, data, mass)
    both = 0.05 + 0.6 * 0.2 * 0.25
    rotor = 1e-4 * 36.0
    first = 0.03 + 0.6 * 0.2**2 + 2 * both - 0.05 + rotor
    assert mass == pytest.approx(np.array([[first, both], [both, 0.05 + rotor]]))
    assert not any(drive.effects for drive in mechanism.drives.values())
