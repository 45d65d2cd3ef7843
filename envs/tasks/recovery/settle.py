"""The end of a recovery: upright detector and settle ramp, as the shim has them.

    upright once θ < 10° and |ω| < 4 rad/s have held for 0.5 s (paper)
    from then on  target = start + (stance − start)(3s² − 2s³),  s = (t − t₀)/T ≤ 1
    T = max(1.5 s, 1.5 max |stance − start| / (0.8 α/Δt))

`fingers_robot.behaviour.upright` and `fingers_robot.behaviour.settle` run on the hand
and know no JAX; here is the same for many worlds at once, and a test compares both.
"""

from dataclasses import dataclass

import flax.struct
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from envs.rotations import unrotate
from envs.signals import tilt_from_level
from rewards import safe_norm

UPRIGHT_TILT_DEG = 10.0
UPRIGHT_SPEED_RPS = 4.0
UPRIGHT_S = 0.5
RAMP_S = 1.5
_SPEED_SHARE = 0.8
_ROUNDING_S = 1e-4
_NEVER = -1


@flax.struct.dataclass
class Settling:
    """How far the end of a recovery has come.

    Attributes:
        level_since: control step since which the hand is level and calm; −1 if not.
        ramp_since: control step at which the detector fired; −1 before.
        start_rad: joint targets [rad] of that step.
    """

    level_since: Int[Array, "*b"]
    ramp_since: Int[Array, "*b"]
    start_rad: Float[Array, "*b joints"]

    @property
    def begun(self) -> Bool[Array, "*b"]:
        """Whether the detector has fired."""
        return self.ramp_since != _NEVER


@dataclass(frozen=True)
class Settle:
    """What does not change while a hand settles.

    Attributes:
        goal_rad: joint targets that hold the stance [rad].
        q_off: rotation from the palm to V, w x y z.
        dt_s: control interval [s].
        action_scale_rad: α, the fastest motion of a policy per control step [rad].
    """

    goal_rad: tuple[float, ...]
    q_off: tuple[float, ...]
    dt_s: float
    action_scale_rad: float

    def step(
        self,
        settling: Settling,
        gravity_b: Float[Array, "3"],
        angvel_b: Float[Array, "3"],
        proposed_rad: Float[Array, " joints"],
        steps: Int[Array, ""],
    ) -> tuple[Settling, Float[Array, " joints"]]:
        """One control step: θ = policy's target, or θ_0 + (θ* − θ_0)(3s² − 2s³).

        Args:
            settling: state after the step before.
            gravity_b: unit vector of gravity in the palm frame, as the IMU measures it.
            angvel_b: angular velocity of the palm [rad/s], as the IMU measures it.
            proposed_rad: joint targets that the policy asks for [rad].
            steps: number of this control step in the episode.

        Returns:
            The new state, and the joint targets θ [rad] of this step.

        Source:
            Paper, fall recovery (upright detector); duration and shape of the ramp are
            the shim's (`fingers_robot.behaviour.settle`).
        """
        ramped = self._ramp(settling, steps)
        target = jnp.where(settling.begun, ramped, proposed_rad)
        level = level_and_calm(self.q_off, gravity_b, angvel_b)
        known = settling.level_since != _NEVER
        since = jnp.where(known, settling.level_since, steps)
        since = jnp.where(level, since, _NEVER)
        waited_s = (steps - since) * self.dt_s
        fires = level & (waited_s >= UPRIGHT_S - _ROUNDING_S) & ~settling.begun
        return Settling(
            level_since=since,
            ramp_since=jnp.where(fires, steps, settling.ramp_since),
            start_rad=jnp.where(fires, proposed_rad, settling.start_rad),
        ), target

    def over(self, settling: Settling, steps: Int[Array, ""]) -> Bool[Array, ""]:
        """Whether the ramp has come to its end in control step `steps`: s = 1 [1].

        Source:
            Ours; see `step`.
        """
        return settling.begun & (self._share(settling, steps) >= 1.0)

    def _ramp(
        self, settling: Settling, steps: Int[Array, ""]
    ) -> Float[Array, " joints"]:
        start, goal = settling.start_rad, jnp.array(self.goal_rad)
        s = self._share(settling, steps)
        return start + (goal - start) * (s * s * (3.0 - 2.0 * s))

    def _share(self, settling: Settling, steps: Int[Array, ""]) -> Float[Array, ""]:
        """Share of the ramp's duration that has passed, in [0, 1]."""
        speed_rps = _SPEED_SHARE * self.action_scale_rad / self.dt_s
        away = jnp.abs(jnp.array(self.goal_rad) - settling.start_rad)
        duration_s = jnp.maximum(RAMP_S, 1.5 * jnp.max(away) / speed_rps)
        elapsed_s = (steps - settling.ramp_since) * self.dt_s
        return jnp.clip(elapsed_s / duration_s, 0.0, 1.0)


def start_settling(joints: int) -> Settling:
    """State at an episode's start."""
    never = jnp.array(_NEVER, jnp.int32)
    return Settling(never, never, jnp.zeros(joints))


def level_and_calm(
    q_off: tuple[float, ...],
    gravity_b: Float[Array, "3"],
    angvel_b: Float[Array, "3"],
) -> Bool[Array, ""]:
    """Whether the hand is upright in this moment, θ < 10° ∧ ‖ω‖ < 4 rad/s.

    The detector asks for 0.5 s of it.

    Args:
        q_off: rotation from the palm to V, w x y z.
        gravity_b: unit vector of gravity in the palm frame, from which the tilt θ.
        angvel_b: angular velocity ω of the palm [rad/s].

    Returns:
        One flag [1].

    Source:
        Paper, fall recovery (upright detector).
    """
    tilt_rad = tilt_from_level(unrotate(jnp.array(q_off), gravity_b))
    level = tilt_rad < jnp.deg2rad(UPRIGHT_TILT_DEG)
    return level & (safe_norm(angvel_b) < UPRIGHT_SPEED_RPS)


def action_toward(
    target_rad: Float[Array, " joints"],
    goal_rad: Float[Array, " joints"],
    action_scale_rad: float,
    action_clip: float,
) -> Float[Array, " joints"]:
    """The policy output that would move the targets so, a = clip(atanh(Δ/α), ±c).

    Args:
        target_rad: joint targets before [rad].
        goal_rad: joint targets after [rad].
        action_scale_rad: α [rad].
        action_clip: c [1].

    Source:
        Ours: the inverse of the paper's action, up to its clip.
    """
    most = jnp.tanh(action_clip)
    share = jnp.clip((goal_rad - target_rad) / action_scale_rad, -most, most)
    return jnp.arctanh(share)
