"""Mean targets of the equal parts of a step, in which a simulation reads them.

The path of the targets costs as much as the motion behind it and is the same for all
candidates that differ in the motion alone, most of a fit: it is walked once. A step of
the grid keeps as many targets as two of its whole length may need. A part is shorter,
and most of them would take no time in it: each part gets those that may.
"""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from sysid.diagnosis.fits.lanes import in_lanes, lanes_first
from sysid.diagnosis.fits.memory import Memory, remembered
from sysid.diagnosis.fits.paths import Names, Values, path_rows, path_values
from sysid.diagnosis.replay.command import Params, command_path, held_command
from sysid.diagnosis.replay.motion import Track
from sysid.diagnosis.side_by_side import side_by_side

NEAR = 1e-3
"""Share of a part by which a target may miss it, of rounding."""

MOVING = ("lowpass_cutoff", "slew_limit", "directional_slew", "acceleration_limit")
"""Effects with which the command depends on where it was, unless infinite."""


def part_targets(
    track: Track, params: Values, dt: float, parts: int, known: Memory
) -> tuple[Float[np.ndarray, "u t k p"], Int[np.ndarray, " c"]]:
    """Mean commands of candidates over a step's equal parts k; see `command_path`.

    Args:
        track: with targets and when they were sent.
        params: values of the parameters by effect.
        dt: length of a part [s].
        parts: number of parts of a step.
        known: paths so far of the same track and parts; it grows.

    Returns:
        Means [rad], in single precision, once for those that have the same path, and
        which of them is a candidate's.

    Source:
        Ours.
    """
    names, rows = path_rows(params)
    first, which = _first_of_each(rows)
    rows = rows[first]

    def batch(slots: int, lanes: np.ndarray, count: int, moves: bool) -> np.ndarray:
        some = path_values(names, lanes)
        return np.asarray(_walked(track, some, dt, parts, slots, moves))[:count]

    def walked(new: np.ndarray) -> np.ndarray:
        moves = _moves(names, rows[new])
        kinds = [(k, np.flatnonzero(moves == k)) for k in (False, True)]
        slots = _targets_of_a_part(track, parts)
        calls = [
            partial(batch, slots, rows[lanes], count, k)
            for k, who in kinds
            for lanes, count in in_lanes(new[who])
        ]
        order = np.concatenate([who for _, who in kinds])
        return np.concatenate(side_by_side(calls))[np.argsort(order)]

    return remembered(known, rows, walked), which


def _first_of_each(
    rows: Float[np.ndarray, "c n"],
) -> tuple[Int[np.ndarray, " u"], Int[np.ndarray, " c"]]:
    """Returns where each row is for the first time, in their order, and whose it is."""
    _, first, which = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    return first[order], np.argsort(order)[which.reshape(-1)]


def _moves(names: Names, rows: np.ndarray) -> np.ndarray:
    """Where a command depends on where it was."""
    limits = [i for i, (effect, _) in enumerate(names) if effect in MOVING]
    return np.any(np.isfinite(rows[:, limits]), axis=1)


def _targets_of_a_part(track: Track, parts: int) -> int:
    """The most targets that may act in one part of a step, with the one before it.

    n = 1 + max #{i : −2 < t_i < 0}, with t_i in parts before the end of a part: a delay
    moves beginnings by less than a part, whole parts aside.
    """
    ages = _ages(np.asarray(track.sent), parts, np)
    inside = (ages > -2.0 - NEAR) & (ages < NEAR)
    return min(int(inside.sum(2).max()) + 1, track.sent.shape[1])


@partial(jax.jit, static_argnames=("dt", "parts", "slots", "moves"))
def _walked(
    track: Track, params: Params, dt: float, parts: int, slots: int, moves: bool
) -> Float[Array, "c t k p"]:
    """Mean commands along the last targets of every part."""
    ages = _ages(track.sent, parts, jnp)
    last = jnp.sum(ages <= 0.0, 2, keepdims=True) - 1
    index = jnp.clip(last + jnp.arange(1 - slots, 1)[:, None], 0)
    held = jnp.broadcast_to(track.held[:, None], ages.shape)
    held, sent = (
        jnp.take_along_axis(x, index, 2).reshape(-1, slots, x.shape[3])
        for x in (held, ages)
    )
    if moves:
        mean = command_path(held, sent, params, dt, False).mean
    else:
        mean = held_command(held, sent, params, dt)
    return lanes_first(mean.reshape(-1, parts, *mean.shape[1:]))


def _ages(sent, parts: int, xp):
    """When targets were sent before the ends of parts, negative [parts]."""
    ends = xp.arange(1, parts + 1)[None, :, None, None]
    return parts * (sent[:, None] + 1.0) - ends
