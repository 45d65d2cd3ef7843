"""Checkpoints: the whole training state, committed at once, checked when read.

A checkpoint is a directory named after its iteration: arrays in Orbax format,
`meta.json` and a manifest with the SHA-256 of every file. It is written under a
temporary name and renamed when it is complete and on the disk, so that a process killed
at any moment leaves the checkpoints before it as they were.
"""

import json
import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import orbax.checkpoint as ocp

from envs.config.atomic_file import sync
from envs.config.json_file import read_table
from fingers_mjx.runs.files import OutOfSpace, room_for
from fingers_mjx.runs.intact import check
from fingers_mjx.runs.intact import checkpoints as checkpoints
from fingers_mjx.runs.intact import newest as newest
from fingers_mjx.runs.seal import problem, seal
from fingers_mjx.runs.tree import (
    check_layout,
    describe,
    from_host,
    leaf_names,
    to_host,
)

_TMP, _OLD = ".tmp-", ".old-"
_MARGIN_BYTES = 1 << 20


@dataclass(frozen=True)
class Saved:
    """A checkpoint that was read: its arrays by name and what was noted beside them."""

    path: Path
    arrays: Mapping[str, np.ndarray]
    meta: Mapping[str, Any]

    @property
    def iteration(self) -> int:
        """Iterations that were done when it was saved."""
        return self.meta["iteration"]

    def into(self, template: Any) -> Any:
        """Returns the saved leaves in the structure of `template`, on the device.

        Raises:
            InputError: if the leaves do not fit, naming the first.
        """
        check_layout(self.path, self.meta["leaves"], template)
        return from_host(template, self.arrays)

    def part(self, template: Any) -> Any:
        """Returns those of the saved leaves that `template` has, in its structure.

        Raises:
            InputError: if one of them is missing or of another shape.
        """
        wanted = set(leaf_names(template))
        saved = {k: v for k, v in self.meta["leaves"].items() if k in wanted}
        check_layout(self.path, saved, template)
        return from_host(template, self.arrays)


def save(
    directory: Path,
    iteration: int,
    state: Any,
    meta: Mapping[str, Any],
    keep: int,
) -> Path:
    """Writes a checkpoint and returns its path; then deletes all but the `keep` newest.

    Args:
        directory: of all checkpoints of the run.
        iteration: iterations done.
        state: pytree of arrays; typed random keys are kept as such.
        meta: JSON-able notes (configuration, versions).
        keep: number of checkpoints kept.

    Raises:
        OutOfSpace: if the disk is full; earlier checkpoints are intact.
    """
    arrays, final = to_host(state), directory / f"{iteration:08d}"
    needed = sum(a.nbytes for a in arrays.values()) + _MARGIN_BYTES
    notes = {**meta, "iteration": iteration, "leaves": describe(state)}
    tmp = directory / f"{_TMP}{iteration:08d}"
    try:
        with room_for(final, needed):
            _make(tmp)
            _write_state(tmp, arrays, notes)
            _write_notes(tmp, notes)
            seal(tmp, iteration)
            _free(final)
            _rename(tmp, final)
            sync(directory)
    except OutOfSpace:
        shutil.rmtree(tmp, ignore_errors=True)
        raise
    for path in checkpoints(directory)[:-keep]:
        _hide(path)
    for hidden in directory.glob(f"{_OLD}*"):
        _delete(hidden)
    return final


def clean(directory: Path) -> None:
    """Removes what a killed process had half written or half deleted."""
    for path in directory.glob(".*"):
        if path.name.startswith((_TMP, _OLD)):
            shutil.rmtree(path)


def set_aside(directory: Path, after: int) -> None:
    """Renames checkpoints later than iteration `after`, such as damaged ones.

    Their names then begin with "damaged-", or with "ahead-" if they are intact: those
    of a population's members that were saved before it was killed.
    """
    for path in checkpoints(directory):
        if (iteration := int(path.name)) > after:
            kind = "damaged" if problem(path, iteration) else "ahead"
            target = path.with_name(f"{kind}-{path.name}")
            shutil.rmtree(target, ignore_errors=True)
            path.rename(target)


def load(path: Path) -> Saved:
    """Reads the checkpoint at `path`, every byte of it checked.

    Raises:
        InputError: if it is missing, incomplete or altered.
    """
    check(path)
    meta = read_table(path / "meta.json")
    with ocp.PyTreeCheckpointer() as reader:
        stored = reader.restore((path / "state").absolute())
    empty = {name: np.zeros(shape) for name, shape in meta["empty"].items()}
    return Saved(path, {**stored, **empty}, meta)


def _make(tmp: Path) -> None:
    """Makes the directory that will become the checkpoint, empty."""
    shutil.rmtree(tmp, ignore_errors=True)
    tmp.mkdir(parents=True)


def _write_state(
    tmp: Path, arrays: Mapping[str, np.ndarray], notes: dict[str, Any]
) -> None:
    """Writes the arrays; those without entries, which Orbax refuses, go to `notes`."""
    stored = {name: array for name, array in arrays.items() if array.size}
    notes["empty"] = {k: a.shape for k, a in arrays.items() if not a.size}
    with ocp.PyTreeCheckpointer() as writer:
        writer.save((tmp / "state").absolute(), stored)
    _forget_place(tmp / "state" / "commit_success.txt")


def _write_notes(tmp: Path, notes: Mapping[str, Any]) -> None:
    text = json.dumps(notes, indent=1) + "\n"
    (tmp / "meta.json").write_text(text, encoding="utf-8")


def _forget_place(marker: Path) -> None:
    """Takes the path of the run out of Orbax's marker, which only has to be there."""
    if marker.exists():
        marker.write_text("complete\n", encoding="utf-8")


def _free(final: Path) -> None:
    """Hides an older checkpoint of the same iteration."""
    if final.exists():
        final.rename(final.with_name(f"{_OLD}{final.name}"))


def _hide(path: Path) -> None:
    """Takes a checkpoint out of sight in one step, before it is deleted."""
    path.rename(path.with_name(f"{_OLD}{path.name}"))


def _delete(hidden: Path) -> None:
    shutil.rmtree(hidden)


def _rename(path: Path, to: Path) -> None:
    path.rename(to)
