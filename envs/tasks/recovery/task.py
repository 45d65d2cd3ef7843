"""Fall recovery: get up from the thumb side or the wrist side into the crawl stance."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import flax.struct
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from envs.base import State
from envs.commands import CommandConfig, sample_command
from envs.env import HandEnv
from envs.hand.hand_file import HandFile, load_hand_file
from envs.hand.stance import Stance, stance_of
from envs.memory import Memory, PerWorldState
from envs.physics import PhysicsOutput, PhysicsState
from envs.plant import Plant
from envs.rotations import about_z, multiply, unrotate
from envs.scoring import check_weights
from envs.settings import HandSettings
from envs.signals import Signals
from envs.streams import stream
from envs.task import BareTask
from envs.tasks.recovery.falls import SIDES, Falls, falls_of
from envs.tasks.recovery.measures import recovery_measures
from envs.tasks.recovery.practice import Poses, practice_of
from envs.tasks.recovery.settle import (
    Settle,
    Settling,
    action_toward,
    level_and_calm,
    start_settling,
    tilt_rad,
)
from rewards import RECOVERY, RewardTable


def _no_command() -> CommandConfig:
    """A hand that gets up is asked to stand (ours; the paper gives no value)."""
    still = (0.0, 0.0)
    return CommandConfig(still, still, still)


@dataclass(frozen=True)
class RecoveryConfig(HandSettings):
    """Settings of fall recovery; the common ones are those of `HandSettings`.

    Attributes:
        command: the planar and yaw commands that the policy sees, as a crawl policy
            does (paper); nothing is paid for following them.
        settle: whether, as on the hand, the joint targets are taken to the stance once
            the upright detector has fired. Evaluations do so; in training the policy
            goes on, so that it learns to stay up (paper).
        practice_fraction: share of training episodes that start from a practice pose
            (`envs.tasks.recovery.practice`) instead of a fall (ours). With `settle`
            there are none.
    """

    command: CommandConfig = field(default_factory=_no_command)
    settle: bool = False
    practice_fraction: float = field(default=0.0, metadata={"low": 0.0, "high": 1.0})
    # A curled hand is near itself and the floor with many links: C MuJoCo counts up to
    # 14 contacts under random actions, and Warp's pool also holds the near pairs.
    contacts_per_world: int = field(default=96, metadata={"low": 1, "free": True})

    def __post_init__(self) -> None:
        super().__post_init__()
        check_weights(RECOVERY, self.weights)


@flax.struct.dataclass
class RecoveryMemory:
    """What an episode carries.

    Attributes:
        side: side on which the hand fell, a position in `SIDES`.
        settling: upright detector and settle ramp.
    """

    side: Int[Array, "*b"]
    settling: Settling


@dataclass(frozen=True)
class Recovery(BareTask):
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

    def begin_world(self) -> dict[str, Any]:
        """Nothing outlives an episode."""
        return {}

    def begin_episode(
        self, key: Array, world: PerWorldState, state: PhysicsState
    ) -> dict[str, Any]:
        """The command of the whole episode, the side of the fall, and no settling."""
        del world, state
        sides = jnp.array([list(SIDES).index(side) for side in self.falls.side])
        settling = start_settling(len(self.stance.target_rad))
        return {
            "command": sample_command(key, self.config.command),
            "task": RecoveryMemory(sides[self._drawn(key)], settling),
        }

    def start(
        self, key: Array, plant: Plant, world: PerWorldState
    ) -> tuple[PhysicsState, Float[Array, "20"]]:
        """One of the fallen poses at rest, at a random heading.

        The joint targets are the joint angles: the motors were off and are energized
        where the joints are (paper), so that nothing pushes at first.
        """
        turn = jax.random.uniform(
            stream(key, "heading"), (), minval=-jnp.pi, maxval=jnp.pi
        )
        pose = self._pose(key)
        quat_w = multiply(about_z(turn), pose[3:7])
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
    ) -> dict[str, Array]:
        """How near the stance the hand is, and how far its recovery has come.

        `tilt_rad_v` [rad] and `joint_error_rad`, the mean of |q − q*| [rad], tell the
        former; `settling` is 1 once the upright detector has fired, `settled` once the
        ramp is over, and `fall_side` a position in `SIDES`.
        """
        del plant, output
        memory = carried["task"]
        error = jnp.abs(signals.joint_pos - jnp.array(self.stance.joint_pos_rad))
        settled = self.settle.over(memory.settling, carried["steps"])
        return {
            "tilt_rad_v": tilt_rad(self.stance.q_off, signals.gravity_b),
            "joint_error_rad": jnp.mean(error),
            "settling": memory.settling.begun.astype(jnp.float32),
            "settled": settled.astype(jnp.float32),
            "fall_side": memory.side,
        }

    def magnitudes(
        self, memory: Memory, signals: Signals, valid: Bool[Array, ""]
    ) -> tuple[Memory, dict[str, Array]]:
        """What the goals compare: gravity in V, height, and both of the stance."""
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
        """Never; only time ends an episode (paper)."""
        del signals
        return jnp.zeros((), bool)

    def advance(self, memory: Memory, signals: Signals) -> Memory:
        """Nothing changes within an episode."""
        del signals
        return memory

    def measures(self, signals: Signals) -> dict[str, Float[Array, ""]]:
        """Tilt, joint error, and whether the hand is upright in this step.

        `upright` is 1 where the stance-relative tilt is below 10° and the angular speed
        below 4 rad/s (paper, upright detector, which asks for 0.5 s of it).
        """
        upright = level_and_calm(self.stance.q_off, signals.gravity_b, signals.angvel_b)
        return {
            "upright": upright.astype(jnp.float32),
            "tilt_deg": jnp.rad2deg(signals.extra["tilt_rad_v"]),
            "joint_error_rad": signals.extra["joint_error_rad"],
        }

    def episode_measures(
        self, recorded: Mapping[str, Array], counts: Bool[Array, " T"]
    ) -> dict[str, Float[Array, ""]]:
        """Righted, how fast and how near the stance; over all falls and per side."""
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

    def _pose(self, key: Array) -> Float[Array, "27"]:
        """Generalized position of the fall or practice pose of an episode."""
        fall = jnp.array(self.falls.qpos)[self._drawn(key)]
        if not self.practice:
            return fall
        which, pick = jax.random.split(stream(key, "practice"))
        poses = jnp.array(self.practice)
        practice = poses[jax.random.randint(pick, (), 0, len(poses))]
        chosen = jax.random.uniform(which) < self.config.practice_fraction
        return jnp.where(chosen, practice, fall)

    def _drawn(self, key: Array) -> Int[Array, ""]:
        """Number of the pose that an episode starts from."""
        return jax.random.randint(stream(key, "fall"), (), 0, len(self.falls.side))

    def _gravity_v(self, signals: Signals) -> Float[Array, "3"]:
        return unrotate(jnp.array(self.stance.q_off), signals.gravity_b)


class RecoveryEnv(HandEnv):
    """One world of fall recovery; the caller vmaps it.

    Args:
        config: settings of the task.
        backend, num_worlds, hand, stance: see `envs.env.HandEnv`.
    """

    def __init__(
        self,
        config: RecoveryConfig | None = None,
        backend: str = "cpu",
        num_worlds: int = 1,
        hand: HandFile | None = None,
        stance: Stance | None = None,
    ):
        hand = hand or load_hand_file()
        stance = stance or stance_of(hand)
        config, falls = config or RecoveryConfig(), falls_of(hand, stance)
        wanted = config.practice_fraction > 0.0 and not config.settle
        practice = practice_of(hand, stance) if wanted else ()
        middle_b = hand.nominal.palm.inertial_pos
        task = Recovery(config, stance, falls, middle_b, practice)
        super().__init__(task, backend, num_worlds, hand, stance)

    def step(self, state: State, action: Float[Array, "20"]) -> State:
        """Advances one control step; see `RecoveryConfig.settle`."""
        if self.config.settle:
            state, action = self._settled(state, action)
        return super().step(state, action)

    def _settled(
        self, state: State, action: Float[Array, "20"]
    ) -> tuple[State, Float[Array, "20"]]:
        """Puts the ramp's motion in the place of the policy's, once it is upright."""
        memory, config, settle = state.memory, self.config, self.task.settle
        scale, clip = config.action_scale_rad, config.action_clip
        action = jnp.clip(action, -clip, clip)
        proposed = self.plant.next_target(memory.target, action, scale)
        told = jax.tree.map(lambda x: x[-1], memory.history)
        settling, target = settle.step(
            memory.task.settling, told.gravity, told.angvel, proposed, memory.steps
        )
        ramped = action_toward(memory.target, target, scale, clip)
        action = jnp.where(memory.task.settling.begun, ramped, action)
        task = memory.task.replace(settling=settling)
        return state.replace(memory=memory.replace(task=task)), action
