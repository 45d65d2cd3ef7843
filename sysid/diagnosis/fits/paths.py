"""Paths of the targets, each walked once for all candidates that have it.

A path takes longer than all that is behind it, and many candidates of a fit differ in
that alone. Those that keep to an acceleration take longer still, and so do those that
ask for the path between steps: they are walked apart.
"""

from functools import partial

import jax
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from sysid.diagnosis.fits.lanes import FEW_LANES, in_lanes, lanes_first
from sysid.diagnosis.fits.memory import Memory, remembered
from sysid.diagnosis.replay.command import EFFECTS, Params, command_path, paths_of
from sysid.diagnosis.replay.motion import Track
from sysid.diagnosis.side_by_side import side_by_side

Values = dict[str, dict[str, Float[np.ndarray, " c"]]]
"""Values of parameters of candidates c, by effect and name."""

Names = list[tuple[str, str]]
"""Parameters by effect and name."""

SLOWEST = ("acceleration_limit", "acceleration_rad_s2")
"""The parameter without which a path is walked in a third of the time."""

ASKS = ("torque_slope_limit", "slope_nm_s")
"""The only one that asks what is ahead within a step."""


def path_rows(params: Values) -> tuple[Names, Float[np.ndarray, "c n"]]:
    """Returns the parameters of a path, and their values for every candidate."""
    names = [(e, name) for e in EFFECTS if e in params for name in params[e]]
    return names, np.stack([np.asarray(params[e][name]) for e, name in names], 1)


def path_values(names: Names, rows: Float[np.ndarray, "c n"]) -> Values:
    """Returns the values of parameters by effect and name."""
    values: Values = {}
    for (effect, name), column in zip(names, rows.T, strict=True):
        values.setdefault(effect, {})[name] = column
    return values


def command_paths(
    track: Track, params: Values, dt: float, known: Memory
) -> tuple[Float[np.ndarray, "u k t p"], Int[np.ndarray, " c"]]:
    """Path, ripple and what is ahead of candidates; see `command.Commands`.

    Args:
        track: with targets and when they were sent.
        params: values of the parameters by effect.
        dt: step of the grid [s].
        known: paths so far of the same targets; it grows.

    Returns:
        All of them one behind the other [rad], in single precision, once for those that
        have the same, and which of them is a candidate's.

    Source:
        Ours.
    """
    names, rows = path_rows(params)
    slow, asks = (_limited(params, *name, len(rows)) for name in (SLOWEST, ASKS))
    kind = np.where(slow, 2, 1 * asks)
    both = np.column_stack([rows, kind.astype(rows.dtype)])
    rows, which = np.unique(both, axis=0, return_inverse=True)
    kind, which = rows[:, -1], which.reshape(-1)

    def batch(k: int, lanes: np.ndarray, count: int) -> np.ndarray:
        some = path_values(names, lanes[:, :-1])
        if k < 2:
            some.pop(SLOWEST[0], None)
        return np.asarray(_walked(track.held, track.sent, some, dt, k > 0))[:count]

    def walked(new: np.ndarray) -> np.ndarray:
        kinds = [(k, np.flatnonzero(kind[new] == k)) for k in range(3)]
        calls = [
            partial(batch, k, *lanes)
            for k, who in kinds
            for lanes in in_lanes(rows[new[who]], FEW_LANES)
        ]
        order = np.concatenate([who for _, who in kinds])
        return np.concatenate(side_by_side(calls))[np.argsort(order)]

    return remembered(known, rows, walked), which


def _limited(
    params: Values, effect: str, name: str, count: int
) -> Bool[np.ndarray, " c"]:
    """Where an effect limits anything."""
    return np.isfinite(params[effect][name] if effect in params else [np.inf] * count)


@partial(jax.jit, static_argnames=("dt", "between"))
def _walked(
    held: Float[Array, "t s p"],
    sent: Float[Array, "t s p"],
    params: Params,
    dt: float,
    between: bool,
) -> Float[Array, "c k t p"]:
    return lanes_first(paths_of(command_path(held, sent, params, dt, between)))
