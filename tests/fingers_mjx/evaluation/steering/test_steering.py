"""Hands that turn as asked, but for a drift: what is measured of them is known."""

from dataclasses import dataclass
from typing import Any

import flax.struct
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from envs.base import State
from envs.errors import InputError
from envs.signals import Signals
from envs.tasks.push.guide import heading
from fingers_mjx.evaluation.evaluate import Episodes, Measuring, evaluate
from fingers_mjx.evaluation.steering.commands import _means
from fingers_mjx.evaluation.steering.heading_hold import _kept
from fingers_mjx.evaluation.steering.worlds import (
    Commanded,
    Course,
    Holding,
)
from fingers_robot.behaviour.heading import HeadingConfig

JOINTS = ("joint_pos", "joint_vel", "joint_acc", "torque_nm")
ACTIONS = ("action", "previous_action")
DT, STEPS, WORLDS = 0.02, 400, 5
Q_OFF = (1.0, 0.0, 0.0, 0.0)
GAINS = HeadingConfig(gain=2.0, offset_rad_s=0.0, low=-0.45, high=0.45)
STEPS_RAD = np.deg2rad([0.0, 15.0, -15.0, 30.0, -30.0])
COMMANDS = np.tile([0.1, 0.0, 0.0], (WORLDS, 1))


@flax.struct.dataclass
class Carried:
    """What is carried: the command, and what `Holding` adds."""

    command: Any
    task: Any = None


class Stance:
    """The stance of the turning hands: V is the palm."""

    q_off = Q_OFF


@dataclass(frozen=True)
class TurningHands:
    """Each turns at its command plus a drift, and walks as fast as it should."""

    drift_rps: float = 0.0
    obeys: float = 1.0
    dt: float = DT
    num_envs: int = WORLDS
    stance: Any = Stance

    def reset(self, key):
        command = jnp.full((WORLDS, 3), 9.0)  # is to be replaced
        return self._state(jnp.linspace(-3.0, 3.0, WORLDS), Carried(command), 0.0)

    def step(self, state, action):
        rate = self.obeys * state.memory.command[:, 2] + self.drift_rps
        heading = state.data + DT * rate
        return self._state(heading, state.memory, rate)

    def _state(self, heading, carried, rate):
        zero, vectors = jnp.zeros(WORLDS), jnp.zeros((WORLDS, 3))
        joints = jnp.zeros((WORLDS, 20))
        half = heading / 2
        quat = jnp.stack([jnp.cos(half), zero, zero, jnp.sin(half)], axis=-1)
        tips = jnp.zeros((WORLDS, 5, 3))
        signals = Signals(
            **dict.fromkeys(
                ("joint_pos", "joint_vel", "joint_acc", "torque_nm"), joints
            ),
            **dict.fromkeys(("action", "previous_action"), joints),
            **dict.fromkeys(("tip_pos_v", "tip_vel_v", "tip_vel_w"), tips),
            **dict.fromkeys(("palm_pos_w", "gravity_b", "angvel_b"), vectors),
            palm_quat_w=quat,
            vel_v=carried.command.at[:, 2].set(0.0),
            angvel_v=vectors.at[:, 2].set(rate),
            tip_force_n=jnp.ones((WORLDS, 5)),
            tip_shear_n=jnp.zeros((WORLDS, 5)),
            pad_tilt_rad=jnp.zeros((WORLDS, 5)),
            link_contact=jnp.zeros((WORLDS, 14)),
            palm_contact=zero,
            tilt_rad=jnp.zeros((WORLDS, 2)),
            command=carried.command,
        )
        return State(
            data=heading,
            obs={"state": joints},
            reward=zero,
            done=zero,
            metrics={},
            info={"truncation": zero},
            signals=signals,
            memory=carried,
        )


def run(worlds):
    wanted = Episodes(WORLDS, STEPS, jax.random.key(0))
    return evaluate(worlds, lambda obs: obs["state"], wanted, Measuring(1.0))


def kept(hands, gains=GAINS):
    table = run(Holding(hands, COMMANDS, STEPS_RAD, gains))
    return [_kept(table, n, step, Q_OFF) for n, step in enumerate(STEPS_RAD)]


def test_each_world_keeps_its_own_command():
    commands = COMMANDS + np.array([[0.0, 0.0, 0.1 * n] for n in range(WORLDS)])
    table = run(Commanded(TurningHands(drift_rps=0.02), commands))
    found = [_means(table, number) for number in range(WORLDS)]
    turned = [one["turn_rate_rad_s"] for one in found]
    np.testing.assert_allclose(turned, 0.1 * np.arange(WORLDS) + 0.02, rtol=1e-4)
    np.testing.assert_allclose([one["vel_x_mps"] for one in found], 0.1, rtol=1e-5)
    assert [one["survival"] for one in found] == [1.0] * WORLDS


def test_a_hand_that_obeys_comes_to_every_heading_and_stays():
    for one in kept(TurningHands()):
        assert one["error_deg"] < 0.1 and abs(one["drift_deg_s"]) < 0.1
        assert one["settled"] == 1.0
    quick, slow = (kept(TurningHands())[index]["settled_s"] for index in (1, 3))
    # 30° less 3° at 0.45 rad/s last 1.05 s, and then the mean has half a window to go.
    assert 1.0 < quick < slow < 5.0 and slow > 1.05 + 0.5


def test_a_drift_is_left_by_the_gain_and_taken_by_the_offset():
    drift = 0.2
    # The first heading of a trace is that after a step of drift.
    left_deg = np.rad2deg(drift / 2.0 - drift * DT)
    for one in kept(TurningHands(drift_rps=drift)):
        assert one["error_deg"] == pytest.approx(left_deg, rel=0.01)
        assert one["settled"] == 0.0 and np.isnan(one["settled_s"])
    against = HeadingConfig(gain=2.0, offset_rad_s=-drift, low=-0.45, high=0.45)
    for one in kept(TurningHands(drift_rps=drift), against):
        assert one["error_deg"] == pytest.approx(np.rad2deg(drift * DT), rel=0.02)
        assert one["settled"] == 1.0


def test_a_hand_that_does_not_turn_settles_nowhere_but_where_it_is():
    found = kept(TurningHands(obeys=0.0))
    assert [one["settled"] for one in found] == [1.0, 0.0, 0.0, 0.0, 0.0]
    np.testing.assert_allclose([one["error_deg"] for one in found], [0, 15, 15, 30, 30])


def test_headings_are_those_of_the_shim():
    from fingers_robot.behaviour.heading import heading as heading_w

    quats = np.random.default_rng(3).normal(size=(50, 4))
    quats /= np.linalg.norm(quats, axis=1, keepdims=True)
    expected = [heading_w(quat) for quat in quats]
    found = jax.vmap(lambda quat: heading(quat, jnp.array(Q_OFF)))(jnp.asarray(quats))
    np.testing.assert_allclose(found, expected, atol=1e-5)


def test_a_course_must_leave_time_to_get_under_way():
    with pytest.raises(InputError, match=r"--seconds: found 3; valid: 4 or more"):
        Course(1, seconds=3.0)
