"""Velocity commands: sampling and resampling."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, PRNGKeyArray

from envs.config.settings.commands import CommandConfig as CommandConfig
from envs.observations import InputTerm
from envs.streams import stream


def sample_command(key: PRNGKeyArray, config: CommandConfig) -> Float[Array, "3"]:
    """Draws a command, c = (1 − b) k ∘ u with u ~ U(low, high) and b ~ Bernoulli(p).

    k is (0, 0, 1) in the share of commands that turn, (1, 1, 0) in that of those that
    are straight, (0, 1, 0) in that of those to the side and 1 in the others.

    Args:
        key: of the draw.
        config: ranges, and the shares, p of standing commands.

    Returns:
        v_x, v_y [m/s] and the yaw rate [rad/s] in V.

    Source:
        Paper, crawling (ranges); the shares are ours.

    Examples:
        Without turning, straight or standing ones, all three parts are drawn:

        >>> config = CommandConfig(turning_fraction=0.0, straight_fraction=0.0)
        >>> command = sample_command(jax.random.key(0), config)
        >>> command.shape, bool(abs(command[0]) <= 0.16)
        ((3,), True)
    """
    ranges = (config.vel_x_mps, config.vel_y_mps, config.yaw_rate_rps)
    low, high = jnp.array(ranges).T
    command = jax.random.uniform(stream(key, "command"), (3,), minval=low, maxval=high)
    stand = jax.random.bernoulli(stream(key, "standing"), config.standing_fraction)
    kind = jax.random.uniform(stream(key, "kind"))
    turns = kind < config.turning_fraction
    least = config.turning_fraction + config.straight_fraction
    straight = ~turns & (kind < least)
    sideways = (kind >= least) & (kind < least + config.sideways_fraction)
    zero = stand | jnp.stack([turns | sideways, turns, straight | sideways])
    return jnp.where(zero, 0.0, command)


def command_term(config: CommandConfig) -> InputTerm:
    """The command as inputs of a policy."""
    ranges = (config.vel_x_mps, config.vel_y_mps, config.yaw_rate_rps)
    return InputTerm("command", 3, "V", "m/s m/s rad/s", ranges)
