"""State of a run that diverged, in one file small enough to send around."""

import io
from pathlib import Path

import numpy as np

from fingers_mjx.ppo.state import Carry
from fingers_mjx.runs.files import write_whole
from fingers_mjx.runs.tree import to_host

LIMIT_BYTES = 50 * 2**20
WORLDS = 16


def dump_state(path: Path, carry: Carry) -> Path:
    """Writes networks, normalizer and the worst worlds to `path` (npz) and returns it.

    Arrays are named by their place in the state; "worlds/index" holds which worlds
    were kept: those with non-finite values first. Adam's moments are omitted, and
    worlds as far as the file would pass 50 MB.
    """
    train = carry.train
    kept = {"params": train.params, "normalizer": train.normalizer}
    arrays = to_host({"train": kept | {"health": train.health}})
    worlds = to_host(carry.worlds)
    batch = carry.worlds.done.shape[0]
    rows = {k: v for k, v in worlds.items() if v.ndim and v.shape[0] == batch}
    free = LIMIT_BYTES - sum(a.nbytes for a in arrays.values()) - 2**20
    number = max(0, min(WORLDS, free * batch // sum(a.nbytes for a in rows.values())))
    index = _worst_worlds(rows, batch)[:number]
    arrays |= {f"worlds/{k}": v[index] for k, v in rows.items()}
    buffer = io.BytesIO()
    np.savez(buffer, allow_pickle=False, **arrays, **{"worlds/index": index})
    write_whole(path, buffer.getvalue())
    return path


def _worst_worlds(rows: dict[str, np.ndarray], batch: int) -> np.ndarray:
    """Returns the numbers of all worlds, those with the most bad values first."""
    bad = np.zeros(batch, np.int64)
    for values in rows.values():
        if np.issubdtype(values.dtype, np.floating):
            bad += np.sum(~np.isfinite(values.reshape(batch, -1)), axis=1)
    return np.argsort(-bad, kind="stable")
