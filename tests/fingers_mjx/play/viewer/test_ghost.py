"""A measured log as a second hand."""

import mujoco
import numpy as np
import pytest
from support.cli_setup import default_hand

from envs.errors import InputError
from envs.hand.model import build_model
from envs.hand.stance import stance_of
from fingers_mjx.play.viewer.ghost import BASE, Ghost, heading, motion_of
from fingers_mjx.play.viewer.view import body_poses
from sysid.logs.log import make_log

NAMES = default_hand().nominal.joint_names
ROWS = 50


@pytest.fixture(scope="module")
def stance():
    return stance_of(default_hand())


@pytest.fixture(scope="module")
def model(stance):
    return build_model(default_hand(), np.array(stance.q_off))


def a_log(stance, base=None, **changed):
    """The stance, with the first joint swinging, and the palm on a straight path."""
    t_s = 0.02 * np.arange(ROWS)
    columns = {
        f"pos.{name}": np.full(ROWS, value)
        for name, value in zip(NAMES, stance.joint_pos_rad, strict=True)
    }
    columns |= {f"cmd.{name}": np.zeros(ROWS) for name in NAMES}
    columns[f"pos.{NAMES[0]}"] = columns[f"pos.{NAMES[0]}"] + 0.1 * np.sin(t_s)
    if base is not None:
        columns |= dict(zip(BASE, base.T, strict=True))
    return make_log(NAMES, t_s, columns | changed, mounting="free")


def path(stance, ahead_m):
    base = np.tile(stance.qpos[:7], (ROWS, 1))
    base[:, 0] += np.linspace(0.0, ahead_m, ROWS)
    return base


def turned(qpos, angle):
    half = np.array([np.cos(angle / 2), 0, 0, np.sin(angle / 2)])
    out, quat = np.array(qpos[:7]), np.zeros(4)
    mujoco.mju_mulQuat(quat, half, out[3:])
    out[3:] = quat
    return out


def test_the_ghost_stands_as_the_log_says(model, stance):
    ghost = Ghost(model, motion_of(a_log(stance), NAMES))
    now = np.array(stance.qpos[:7])
    poses = ghost.at(0.41, now, now)
    data = mujoco.MjData(model)
    data.qpos[: len(stance.qpos)] = stance.qpos
    data.qpos[7] += 0.1 * np.sin(0.40)
    mujoco.mj_kinematics(model, data)
    np.testing.assert_allclose(poses.pos_w, body_poses(data).pos_w, atol=1e-9)
    later = ghost.at(0.81, now, now)
    assert np.abs(later.pos_w - poses.pos_w).max() > 1e-3


def test_a_path_goes_where_the_simulated_hand_heads(model, stance):
    """A log that goes 0.3 m along its own x goes along y for a hand turned by 90°."""
    ghost = Ghost(model, motion_of(a_log(stance, path(stance, 0.3)), NAMES))
    start = turned(stance.qpos, np.pi / 2)
    end = ghost.at(ghost.motion.length_s - 1e-9, start, start)
    begin = ghost.at(0.0, start, start)
    moved = end.pos_w[0] - begin.pos_w[0]
    np.testing.assert_allclose(moved, [0.0, 0.3 * 48 / 49, 0.0], atol=1e-6)
    assert heading(start[3:]) == pytest.approx(heading(stance.qpos[3:7]) + np.pi / 2)


def test_at_its_end_the_log_begins_anew(model, stance):
    ghost = Ghost(model, motion_of(a_log(stance), NAMES))
    assert ghost.row(0.0) == ghost.row(ghost.motion.length_s) == 0
    assert ghost.row(0.031) == 1


def test_where_a_reading_is_missing_there_is_no_ghost(model, stance):
    column = f"pos.{NAMES[4]}"
    gap = np.full(ROWS, stance.joint_pos_rad[4])
    gap[10] = np.nan
    ghost = Ghost(model, motion_of(a_log(stance, **{column: gap}), NAMES))
    now = np.array(stance.qpos[:7])
    assert ghost.at(0.201, now, now) is None
    assert ghost.at(0.221, now, now) is not None


def test_a_log_of_one_joint_is_refused():
    t_s = np.arange(3.0)
    log = make_log(
        ("finger",),
        t_s,
        {"pos.finger": t_s / 10, "cmd.finger": t_s},
        mounting="palm_fixed",
    )
    with pytest.raises(InputError, match="pos"):
        motion_of(log, NAMES)
