"""Velocity commands: sampling and resampling."""

from dataclasses import dataclass, field

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, PRNGKeyArray

from envs.errors import InputError, check_ordered
from envs.observations import InputTerm
from envs.streams import stream


@dataclass(frozen=True)
class CommandConfig:
    """Ranges of the commands in V; the ranges are the paper's.

    Attributes:
        vel_x_mps, vel_y_mps, yaw_rate_rps: uniform ranges.
        resample_s: time between commands; ours, the paper only says that it happens.
        standing_fraction: share of commands that are zero; ours.
        turning_fraction: share without planar velocity; ours.
        straight_fraction: share without yaw rate; ours.
    """

    vel_x_mps: tuple[float, float] = field(
        default=(0.0, 0.16), metadata={"unit": "m/s"}
    )
    vel_y_mps: tuple[float, float] = field(
        default=(-0.16, 0.16), metadata={"unit": "m/s"}
    )
    yaw_rate_rps: tuple[float, float] = field(
        default=(-0.45, 0.45), metadata={"unit": "rad/s"}
    )
    resample_s: float = field(default=5.0, metadata={"unit": "s", "low": 0.02})
    standing_fraction: float = field(
        default=0.05, metadata={"unit": "1", "low": 0.0, "high": 1.0}
    )
    turning_fraction: float = field(
        default=0.0, metadata={"unit": "1", "low": 0.0, "high": 1.0}
    )
    straight_fraction: float = field(
        default=0.0, metadata={"unit": "1", "low": 0.0, "high": 1.0}
    )

    def __post_init__(self) -> None:
        check_ordered(self, "vel_x_mps", "vel_y_mps", "yaw_rate_rps")
        if (shares := self.turning_fraction + self.straight_fraction) > 1.0:
            what = "command.turning_fraction + command.straight_fraction"
            raise InputError("configuration", what, f"{shares:g}", "1 at most")


def sample_command(key: PRNGKeyArray, config: CommandConfig) -> Float[Array, "3"]:
    """Draws a command, c = (1 − b) k ∘ u with u ~ U(low, high) and b ~ Bernoulli(p).

    k is (0, 0, 1) in the share of commands that turn, (1, 1, 0) in that of those that
    are straight and 1 in the others.

    Args:
        key: of the draw.
        config: ranges, and the shares, p of standing commands.

    Returns:
        v_x, v_y [m/s] and the yaw rate [rad/s] in V.

    Source:
        Paper, crawling (ranges); the shares are ours.
    """
    ranges = (config.vel_x_mps, config.vel_y_mps, config.yaw_rate_rps)
    low, high = jnp.array(ranges).T
    command = jax.random.uniform(stream(key, "command"), (3,), minval=low, maxval=high)
    stand = jax.random.bernoulli(stream(key, "standing"), config.standing_fraction)
    kind = jax.random.uniform(stream(key, "kind"))
    turns = kind < config.turning_fraction
    straight = ~turns & (kind < config.turning_fraction + config.straight_fraction)
    zero = stand | jnp.stack([turns, turns, straight])
    return jnp.where(zero, 0.0, command)


def command_term(config: CommandConfig) -> InputTerm:
    """The command as inputs of a policy."""
    ranges = (config.vel_x_mps, config.vel_y_mps, config.yaw_rate_rps)
    return InputTerm("command", 3, "V", "m/s m/s rad/s", ranges)
