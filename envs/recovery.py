"""Fall recovery: get up from the thumb side or the wrist side into the crawl stance."""

from dataclasses import dataclass, field
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from envs.commands import CommandConfig, sample_command
from envs.hand.hand_file import HandFile, load_hand_file
from envs.hand.stance import Stance, stance_of
from envs.hand_env import HandEnv
from envs.hand_settings import HandSettings
from envs.hand_task import BareTask
from envs.memory import Lasting, Memory
from envs.physics import PhysicsState
from envs.plant import Plant
from envs.recovery_falls import Falls, falls_of
from envs.rotations import about_z, multiply, unrotate
from envs.scoring import check_weights
from envs.signals import Signals
from envs.streams import stream
from rewards import RECOVERY, RewardTable, safe_norm

UPRIGHT_TILT_DEG = 10.0
UPRIGHT_SPEED_RPS = 4.0


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
    """

    command: CommandConfig = field(default_factory=_no_command)
    # A curled hand is near itself and the floor with many links: C MuJoCo counts up to
    # 14 contacts under random actions, and Warp's pool also holds the near pairs.
    contacts_per_world: int = field(default=96, metadata={"low": 1})

    def __post_init__(self) -> None:
        super().__post_init__()
        check_weights(RECOVERY, self.weights)


@dataclass(frozen=True)
class Recovery(BareTask):
    """Fall recovery as `envs.hand_task.HandTask`.

    Attributes:
        config: settings of the task.
        stance: the crawl stance that is to be reached.
        falls: poses that episodes start from.
        table: rows of the reward; they may bind every signal and the magnitudes of
            `magnitudes`.
    """

    config: RecoveryConfig
    stance: Stance
    falls: Falls
    table: RewardTable = RECOVERY

    def begin_world(self) -> dict[str, Any]:
        """Nothing outlives an episode."""
        return {}

    def begin_episode(
        self, key: Array, lasting: Lasting, state: PhysicsState
    ) -> dict[str, Any]:
        """The command of the whole episode."""
        del lasting, state
        return {"command": sample_command(key, self.config.command)}

    def start(
        self, key: Array, plant: Plant, lasting: Lasting
    ) -> tuple[PhysicsState, Float[Array, "20"]]:
        """One of the fallen poses at rest, at a random heading, under its targets."""
        count = len(self.falls.side)
        fall = jax.random.randint(stream(key, "fall"), (), 0, count)
        turn = jax.random.uniform(
            stream(key, "heading"), (), minval=-jnp.pi, maxval=jnp.pi
        )
        pose = jnp.array(self.falls.qpos)[fall]
        quat_w = multiply(about_z(turn), pose[3:7])
        qpos = jnp.concatenate([pose[:3], quat_w, pose[7:]])
        rest = jnp.zeros(plant.mj_model.nv)
        return PhysicsState(qpos, rest, rest), jnp.array(self.falls.target_rad)[fall]

    def magnitudes(
        self, memory: Memory, signals: Signals, valid: Bool[Array, ""]
    ) -> tuple[Memory, dict[str, Array]]:
        """What the goals compare: gravity in V, height, and both of the stance."""
        del valid  # no memory of a reward
        return memory, {
            "gravity_v": self._gravity_v(signals),
            "height_m": signals.palm_pos_w[2],
            "stance_height_m": jnp.array(self.stance.root_pos_w[2]),
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
        tilt_deg = jnp.rad2deg(_angle_to_level(self._gravity_v(signals)))
        level = tilt_deg < UPRIGHT_TILT_DEG
        calm = safe_norm(signals.angvel_b) < UPRIGHT_SPEED_RPS
        error = jnp.abs(signals.joint_pos - jnp.array(self.stance.joint_pos_rad))
        return {
            "upright": (level & calm).astype(jnp.float32),
            "tilt_deg": tilt_deg,
            "joint_error_rad": jnp.mean(error),
        }

    def _gravity_v(self, signals: Signals) -> Float[Array, "3"]:
        return unrotate(jnp.array(self.stance.q_off), signals.gravity_b)


class RecoveryEnv(HandEnv):
    """One world of fall recovery; the caller vmaps it.

    Args:
        config: settings of the task.
        backend, num_worlds, hand, stance: see `envs.hand_env.HandEnv`.
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
        task = Recovery(config or RecoveryConfig(), stance, falls_of(hand, stance))
        super().__init__(task, backend, num_worlds, hand, stance)


def _angle_to_level(gravity_v: Float[Array, "3"]) -> Float[Array, ""]:
    """Angle between the upward axis of V and the vertical [rad], in [0, π]."""
    return jnp.arctan2(safe_norm(gravity_v[:2]), -gravity_v[2])
