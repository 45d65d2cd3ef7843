"""The curve as a run of Weights & Biases, in the run directory.

Nothing leaves the machine by itself: `WANDB_MODE=online` sends it while training,
`wandb sync` later. The run keeps its identifier, so a resumed one goes on in it.
"""

import os
import secrets
from pathlib import Path
from typing import Any

from envs.errors import InputError, one_of
from fingers_deploy.files import read_regular
from fingers_mjx.runs.files import write_whole
from fingers_mjx.runs.loggers.base import STEP, TIME, About, Kept, Row, numbers

ID_FILE, MAX_ID_BYTES = "wandb-id.txt", 64
PROJECT = "fingers_mjx"
"""Where runs go unless `WANDB_PROJECT` says otherwise."""
MODES = ("offline", "online", "disabled")


class WandbRun:
    """Appends rows and videos to one run of Weights & Biases.

    Rows stand at their iteration, so those that a resumed run repeats fall on those of
    before the kill.

    Args:
        about: the run.
        kept: what the run has so far; logged too, if the run had no identifier yet.

    Raises:
        ModuleNotFoundError: the extra `wandb` is missing.
        InputError: another mode, or a server that refuses the run.
    """

    def __init__(self, about: About, kept: Kept):
        mode = _mode()
        if mode == "offline":  # wandb reports on itself over the network even then
            os.environ.setdefault("WANDB_ERROR_REPORTING", "false")
        import wandb  # pyright: ignore[reportMissingImports]

        self._wandb: Any = wandb
        file = kept.directory / ID_FILE
        known = file.exists()
        name = (
            read_regular(file, MAX_ID_BYTES) if known else secrets.token_hex(8).encode()
        )
        self._run = _begun(
            wandb, about, kept.directory, name.decode(errors="replace").strip(), mode
        )
        self._run.define_metric(STEP)
        self._run.define_metric("*", step_metric=STEP)
        if not known:
            for row in kept.rows:
                self.append(row)
            for at, path in kept.videos.items():
                self.append_video(at, path)
            write_whole(file, name + b"\n")

    def append(self, row: Row) -> None:
        """Adds one row."""
        self._run.log({STEP: row[STEP], TIME: row[TIME], **numbers(row)})

    def append_video(self, iteration: int, path: Path) -> None:
        """Adds a video."""
        video = self._wandb.Video(str(path), format="gif")
        self._run.log({STEP: iteration, "policy": video})

    def close(self) -> None:
        """Waits until everything is on the disk, or sent."""
        self._run.finish()


def _mode() -> str:
    mode = os.environ.get("WANDB_MODE", MODES[0])
    if mode not in MODES:
        raise InputError("WANDB_MODE", "", mode, one_of(MODES, mode))
    return mode


def _begun(
    wandb: Any, about: About, directory: Path, identifier: str, mode: str
) -> Any:
    """Begins or goes on with a run; names of people and machines stay out of it."""
    settings = wandb.Settings(
        console="off",
        quiet=True,
        save_code=False,
        disable_git=True,
        x_disable_meta=True,
    )
    try:
        return wandb.init(
            project=os.environ.get("WANDB_PROJECT", PROJECT),
            group=about.group or None,
            name=about.name,
            id=identifier,
            config=dict(about.config),
            dir=directory,
            mode=mode,
            # Offline there is nobody to ask whether the run exists.
            resume=None if mode == "offline" else "allow",
            reinit="create_new",
            settings=settings,
        )
    except wandb.errors.Error as error:
        valid = "WANDB_MODE=offline, or a server that takes the run"
        raise InputError("wandb", "", " ".join(str(error).split()), valid) from error
