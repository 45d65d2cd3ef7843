"""Fall recovery: get up from the thumb side or the wrist side into the crawl stance."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import flax.struct
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int, PRNGKeyArray, Shaped

from envs.commands import sample_command
from envs.config.settings.recovery import RecoveryConfig as RecoveryConfig
from envs.hand.hand_file import HandFile
from envs.hand.stance import Stance
from envs.memory import Memory, PerWorldState
from envs.physics.base import PhysicsOutput, PhysicsState
from envs.plant import Plant
from envs.rotations import multiply, unrotate
from envs.signals import Signals, tilt_from_level
from envs.streams import stream
from envs.task import HandTask
from envs.tasks.recovery.falls import SIDES, Falls, falls_of
from envs.tasks.recovery.measures import recovery_measures
from envs.tasks.recovery.practice import Poses, practice_of
from envs.tasks.recovery.settle import (
    Settle,
    Settling,
    action_toward,
    level_and_calm,
    start_settling,
)
from envs.tasks.upright import random_heading
from rewards import RECOVERY, RewardTable


@flax.struct.dataclass
class RecoveryMemory:
    """What an episode carries.

    Attributes:
        pose: number of the fall.
        side: side on which the hand fell, a position in `SIDES`.
        settling: upright detector and settle ramp.
    """

    pose: Int[Array, "*b"]
    side: Int[Array, "*b"]
    settling: Settling


@dataclass(frozen=True)
class Recovery(HandTask):
    """Fall recovery as `envs.task.HandTask`.

    Attributes:
        config: settings of the task.
        stance: the crawl stance that is to be reached.
        falls: poses that episodes start from.
        palm_middle_b: centre of mass of the palm in the palm frame, whose origin is at
            the wrist [m].
        practice: poses that some training episodes start from instead.
        table: rows of the reward; they may bind every signal and the magnitudes of
            `magnitudes`.
    """

    config: RecoveryConfig
    stance: Stance
    falls: Falls
    palm_middle_b: tuple[float, float, float]
    practice: Poses = ()
    table: RewardTable = RECOVERY

    @classmethod
    def on(cls, config: RecoveryConfig, hand: HandFile, stance: Stance) -> "Recovery":
        """The task with the fallen poses of a hand, and practice poses if wanted."""
        wanted = config.practice_fraction > 0.0 and not config.settle
        practice = practice_of(hand, stance) if wanted else ()
        middle_b = hand.nominal.palm.inertial_pos
        falls = falls_of(hand, stance, config.falls == "held_out")
        return cls(config, stance, falls, middle_b, practice)

    def begin_episode(
        self, key: PRNGKeyArray, world: PerWorldState, state: PhysicsState
    ) -> dict[str, Any]:
        """The command of the whole episode, the side of the fall, and no settling."""
        del world, state
        sides = jnp.array([list(SIDES).index(side) for side in self.falls.side])
        settling, pose = start_settling(len(self.stance.target_rad)), self._drawn(key)
        return {
            "command": sample_command(key, self.config.command),
            "task": RecoveryMemory(pose, sides[pose], settling),
        }

    def start(
        self, key: PRNGKeyArray, plant: Plant, world: PerWorldState
    ) -> tuple[PhysicsState, Float[Array, " joints"]]:
        """One of the fallen poses at rest, at a random heading, θ = clip(q, limits).

        The joint targets θ are the joint angles q: the motors were off and are
        energized where the joints are, so that nothing pushes at first.

        Returns:
            The state, and the joint targets [rad].

        Source:
            Paper, fall recovery; how far the fingers curl and the hand leans is ours.
        """
        pose = self._pose(key)
        quat_w = multiply(random_heading(key), pose[3:7])
        qpos = jnp.concatenate([pose[:3], quat_w, pose[7:]])
        rest = jnp.zeros(plant.mj_model.nv)
        target = jnp.clip(pose[7:], *plant.joint_range.T)
        return PhysicsState(qpos, rest, rest), target

    def scene_signals(
        self,
        plant: Plant,
        carried: Mapping[str, Any],
        signals: Signals,
        output: PhysicsOutput,
    ) -> dict[str, Shaped[Array, "..."]]:
        """How near the stance the hand is, and how far its recovery has come.

        Returns:
            `tilt_rad_v`, the tilt θ, and `joint_error_rad` = mean |q − q*|, both [rad];
            `settling`, 1 once the upright detector has fired, `settled`, 1 once the
            ramp is over; `fall_side`, in `SIDES`, and `fall_pose`, numbers [1].

        Source:
            Paper, fall recovery.
        """
        del plant, output
        memory = carried["task"]
        error = jnp.abs(signals.joint_pos - jnp.array(self.stance.joint_pos_rad))
        settled = self.settle.over(memory.settling, carried["steps"])
        return {
            "tilt_rad_v": tilt_from_level(self._gravity_v(signals)),
            "joint_error_rad": jnp.mean(error),
            "settling": memory.settling.begun.astype(jnp.float32),
            "settled": settled.astype(jnp.float32),
            "fall_side": memory.side,
            "fall_pose": memory.pose,
        }

    def magnitudes(
        self, memory: Memory, signals: Signals, valid: Bool[Array, ""]
    ) -> tuple[Memory, dict[str, Float[Array, "..."]]]:
        """What the goals compare: gravity in V, height, and both of the stance.

        With c the palm's centre of mass in its frame, z = p_z − c·g, as g points down.

        Returns:
            `gravity_v` [1], `height_m` z and `stance_height_m` [m], `stance_joint_pos`
            [rad].

        Source:
            Paper, fall recovery (tilt, height, joint pose); the point c is ours.
        """
        del valid  # no memory of a reward
        up_b = unrotate(jnp.array(self.stance.root_quat_w), jnp.array([0.0, 0.0, 1.0]))
        middle_b = jnp.array(self.palm_middle_b)
        return memory, {
            "gravity_v": self._gravity_v(signals),
            "height_m": signals.palm_pos_w[2] - middle_b @ signals.gravity_b,
            "stance_height_m": self.stance.root_pos_w[2] + middle_b @ up_b,
            "stance_joint_pos": jnp.array(self.stance.joint_pos_rad),
        }

    def terminated(self, signals: Signals) -> Bool[Array, ""]:
        """Never, s ∈ ∅ [1]; only time ends an episode.

        Source:
            Paper, fall recovery.
        """
        del signals
        return jnp.zeros((), bool)

    def measures(self, signals: Signals) -> dict[str, Float[Array, ""]]:
        """Tilt, joint error, and whether the hand is upright in this step.

        `upright` is 1 where tilt θ < 10° and ‖ω‖ < 4 rad/s; the upright detector asks
        for 0.5 s of it.

        Returns:
            `upright` [1], `tilt_deg` [°], `joint_error_rad` [rad].

        Source:
            Paper, fall recovery (upright detector).
        """
        upright = level_and_calm(self.stance.q_off, signals.gravity_b, signals.angvel_b)
        return {
            "upright": upright.astype(jnp.float32),
            "tilt_deg": jnp.rad2deg(signals.extra["tilt_rad_v"]),
            "joint_error_rad": signals.extra["joint_error_rad"],
        }

    def episode_measures(
        self, recorded: Mapping[str, Shaped[Array, "T ..."]], counts: Bool[Array, " T"]
    ) -> dict[str, Float[Array, ""]]:
        """Righted, how fast and how near the stance; over all falls and per side.

        Returns:
            `righted` [1], `time_to_upright_s` [s], `final_joint_error_rad` = mean
            |q − q*| [rad]; see `recovery_measures`.

        Source:
            Paper, fall recovery.
        """
        return recovery_measures(recorded, counts, self.config.control_dt_s)

    @property
    def settle(self) -> Settle:
        """Upright detector and settle ramp of this stance."""
        return Settle(
            self.stance.target_rad,
            self.stance.q_off,
            self.config.control_dt_s,
            self.config.action_scale_rad,
        )

    def override(
        self, plant: Plant, memory: Memory, action: Float[Array, " joints"]
    ) -> tuple[Memory, Float[Array, " joints"]]:
        """With `settle`, the ramp's motion once the hand is upright, a ← atanh(Δ/α).

        Returns:
            The memory with the settling of this step, and the output [1] that moves the
            targets by Δ [rad] along the ramp.

        Source:
            Paper, fall recovery (settle ramp).
        """
        if not self.config.settle:
            return memory, action
        config, settle = self.config, self.settle
        scale, clip = config.action_scale_rad, config.action_clip
        action = jnp.clip(action, -clip, clip)
        proposed = plant.next_target(memory.target, action, scale)
        newest = jax.tree.map(lambda x: x[-1], memory.history)
        settling, target = settle.step(
            memory.task.settling, newest.gravity, newest.angvel, proposed, memory.steps
        )
        ramped = action_toward(memory.target, target, scale, clip)
        action = jnp.where(memory.task.settling.begun, ramped, action)
        task = memory.task.replace(settling=settling)
        return memory.replace(task=task), action

    def _pose(self, key: PRNGKeyArray) -> Float[Array, " nq"]:
        """Generalized position of the fall or practice pose of an episode."""
        fall = jnp.array(self.falls.qpos)[self._drawn(key)]
        if not self.practice:
            return fall
        which, pick = jax.random.split(stream(key, "practice"))
        poses = jnp.array(self.practice)
        practice = poses[jax.random.randint(pick, (), 0, len(poses))]
        chosen = jax.random.uniform(which) < self.config.practice_fraction
        return jnp.where(chosen, practice, fall)

    def _drawn(self, key: PRNGKeyArray) -> Int[Array, ""]:
        """Number of the pose that an episode starts from."""
        return jax.random.randint(stream(key, "fall"), (), 0, len(self.falls.side))

    def _gravity_v(self, signals: Signals) -> Float[Array, "3"]:
        return unrotate(jnp.array(self.stance.q_off), signals.gravity_b)
