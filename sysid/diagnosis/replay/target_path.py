"""The path of targets within a step: a low-pass and limits, target by target."""

from dataclasses import dataclass

import flax.struct
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from envs.actuator.effects.command_quantization import quantized
from envs.actuator.effects.directional_slew import towards
from envs.actuator.effects.lowpass_cutoff import filtered
from envs.actuator.effects.slew_limit import limited
from sysid.diagnosis.replay.acceleration import Limits, way_to

WITHIN = (0.35, 0.7)
"""Times within a step at which the command is returned too [steps]."""

_WITHIN = np.asarray(WITHIN, np.float32)[:, None, None]


@flax.struct.dataclass
class PathState:
    """Where a path is within a step; None where nobody asks.

    Attributes:
        smooth, command: low-pass and command [rad].
        total: mean of the command, as far as the step has gone [rad].
        passed: the command at the times `WITHIN` [rad].
        rate: speed of a command that keeps to an acceleration [rad/s].
    """

    smooth: Float[Array, "p c"]
    command: Float[Array, "p c"]
    total: Float[Array, "p c"]
    passed: Float[Array, "k p c"] | None
    rate: Float[Array, "p c"] | None


@dataclass(frozen=True, eq=False)
class Path:
    """What a path depends on.

    Attributes:
        grid: of rounded targets [rad].
        cutoff: of the low-pass [Hz].
        limits: of speed and acceleration.
        dt: step [s].
    """

    grid: Float[Array, " c"]
    cutoff: Float[Array, " c"]
    limits: Limits
    dt: float

    def behind(self, now: PathState, target, start, part) -> PathState:
        """Follows a target that begins at a time of the step for a part of it."""
        cutoff, limits, speeds = self.cutoff, self.limits, self.limits.speeds
        # No time at all would make 0 × ∞ of an absent limit; it changes nothing.
        acts, h = part > 0.0, jnp.maximum(part, 1e-6) * self.dt
        last, before, passed, rate = now.smooth, now.command, now.passed, now.rate
        goal = quantized(target[:, None], self.grid)
        smooth = _chosen(acts, filtered(last, goal, cutoff, h), last)
        # Without a low-pass the goal is there at once, and does not come evenly.
        since = _chosen(jnp.isinf(cutoff), smooth, last)
        moved = _pursuit(before, since, smooth, speeds, h)
        command = _chosen(acts, moved, before)
        follows = (before == last) & (command == smooth)
        lag_s = 1.0 / (2.0 * jnp.pi * cutoff)
        mean = goal - (smooth - last) * lag_s / h
        mean = jnp.where(follows, mean, 0.5 * (before + command))
        way = None
        if rate is not None:
            way = way_to((before, rate), (last, goal, cutoff), limits, h)
            command = _chosen(acts & limits.act, way.command[1], command)
            rate = _chosen(acts & limits.act, way.speed[1], rate)
            mean = _chosen(limits.act, way.mean, mean)
        if passed is not None:
            within = jnp.clip(_WITHIN - start, 1e-6, h / self.dt) * self.dt
            there = filtered(last, goal, cutoff, within)
            there = _pursuit(before, since, there, speeds, within)
            if way is not None:
                there = _chosen(limits.act, way.at(within / h), there)
            passed = passed + acts * (start < _WITHIN) * (there - passed)
        return PathState(smooth, command, now.total + part * mean, passed, rate)


def _pursuit(command, last, goal, speeds, h):
    """Moves at a limited speed towards a goal that moves evenly from `last` to `goal`.

    Where the goal comes to meet it, the command turns round with it within the step.
    """
    gap = last - command
    speed = towards(jnp.where(gap == 0.0, goal - last, gap), *speeds)
    reach = speed * h
    closing = reach - jnp.sign(gap) * (goal - last)
    ends = closing > 0.0
    part = jnp.clip(jnp.abs(gap) / _chosen(ends, closing, 1.0), 0.0, 1.0)
    part = _chosen(ends, part, 1.0 * (gap != 0.0))
    met = command + jnp.sign(gap) * _chosen(part > 0.0, part * reach, 0.0)
    speed = towards(goal - met, *speeds)
    there = limited(met, goal, speed, jnp.maximum(1.0 - part, 0.0) * h)
    return _chosen(jnp.isfinite(speed), there, goal)


def _chosen(condition, one, other) -> Array:
    """Chooses by element; what is not chosen may be infinite."""
    return jnp.asarray(jnp.where(condition, one, other))
