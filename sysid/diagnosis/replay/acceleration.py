"""The command of a servo that keeps to an acceleration, from message to message.

To a goal that is held the profile is exact at any time. Behind a low-pass the goal
moves on: it is held at its middle for half a millisecond at a time.
"""

from functools import partial

import flax.struct
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from envs.actuator.effects.acceleration_limit import profiled
from envs.actuator.effects.lowpass_cutoff import filtered

PART_S = 0.0005
"""Longest time for which a goal behind a low-pass is held [s]."""

Pair = tuple[Float[Array, "*#c"], Float[Array, "*#c"]]


@flax.struct.dataclass
class Limits:
    """How a command may move; infinite where it is not limited.

    Attributes:
        speeds: largest speeds up and down [rad/s].
        acceleration: largest acceleration [rad/s²].
    """

    speeds: Pair
    acceleration: Float[Array, "*#c"]

    @property
    def act(self) -> Array:
        """Where the acceleration is limited."""
        return jnp.isfinite(self.acceleration)


@flax.struct.dataclass
class Way:
    """What a command passes through in a time.

    Attributes:
        command, speed: at its beginning and its end [rad], [rad/s].
        mean: of the command [rad].
        time: how long it takes [s].
    """

    command: Pair
    speed: Pair
    mean: Float[Array, "*#c"]
    time: Float[Array, "*#c"]

    def at(self, part: Float[Array, "*#c"]) -> Float[Array, "*c"]:
        """The command at a share u of the time, on the cubic through both ends.

            c(u) = c₀ + (3 − 2 u) u² (c₁ − c₀) + u (1 − u) ((1 − u) w₀ − u w₁) h

        Args:
            part: u, in [0, 1].

        Returns:
            c [rad].

        Source:
            Textbook Hermite interpolation.
        """
        (c0, c1), (w0, w1) = self.command, self.speed
        bend = part * (1.0 - part) * ((1.0 - part) * w0 - part * w1) * self.time
        return c0 + (3.0 - 2.0 * part) * part**2 * (c1 - c0) + bend


def way_to(
    start: Pair,
    goal: tuple[Array, Array, Array],
    limits: Limits,
    time: Float[Array, "*#c"],
) -> Way:
    """Follows a goal behind a low-pass for a time: ċ = w, |ẇ| ≤ a; see `profiled`.

    Args:
        start: command [rad] and its speed [rad/s].
        goal: the low-pass [rad], its target [rad] and its cutoff [Hz].
        limits: of speed and acceleration; where that is infinite, nothing is right.
        time: h [s].

    Returns:
        The way; its mean is that of the cubics through the parts' ends.

    Source:
        Ours: exact without a low-pass, and with one to second order in `PART_S`.
    """
    last, target, cutoff = goal
    # A goal that no low-pass moves is held for all the time. Each candidate has parts
    # of its own: those of others would make its way depend on its company.
    moving = jnp.where(jnp.isfinite(cutoff), time, 0.0)
    count = jnp.maximum(jnp.ceil(moving / PART_S - 0.01), 1.0)
    acceleration = jnp.where(limits.act, limits.acceleration, 1.0)
    go = partial(profiled, fastest=limits.speeds, acceleration=acceleration)
    part = time / count

    def within(k, carry):
        command, speed, mean = carry
        now = filtered(last, target, cutoff, (k + 0.5) * part)
        gap, after = go(gap=now - command, speed=speed, dt=part)
        there = now - gap
        added = 0.5 * (command + there) + part * (speed - after) / 12.0
        acts, new = k < count, (there, after, mean + added / count)
        return tuple(jnp.where(acts, a, b) for a, b in zip(new, carry, strict=True))

    carry = (*start, jnp.zeros_like(start[0]))
    most = jnp.max(count).astype(jnp.int32)
    command, speed, mean = jax.lax.fori_loop(0, most, within, carry)
    return Way((start[0], command), (start[1], speed), mean, time)
