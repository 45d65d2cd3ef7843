"""Trainings that diverged where another one of the same seed may not: on a GPU."""

import shutil
from pathlib import Path

from fingers_mjx.runs.directory import END_FILE
from fingers_mjx.studies.sweep.spec import Sweep

ASIDE = "~diverged"
"""After the name of a stage, which cannot have it: a training that diverged."""


def begins_again(spec: Sweep, run: Path) -> bool:
    """Whether a stage that diverged is trained anew, from where it began.

    Its last checkpoint may be on the way there already: only another training, which
    the same seed gives on a GPU, shows whether the settings are to blame.

    Args:
        spec: resolved.
        run: directory of the stage.
    """
    return not spec.repeatable and (run / END_FILE).exists()


def set_aside(run: Path) -> None:
    """Renames the directory of a stage that diverged; of several the last is kept.

    Args:
        run: directory of the stage.
    """
    aside = _aside(run)
    shutil.rmtree(aside, ignore_errors=True)
    run.rename(aside)


def diverged_once(member: Path) -> bool:
    """Whether a stage of a member diverged that has not been trained anew.

    Args:
        member: directory of the member.
    """
    ended = [file.parent for file in member.glob(f"*/{END_FILE}")]
    runs = [run for run in ended if not run.name.endswith(ASIDE)]
    return any(not _aside(run).exists() for run in runs)


def trained_anew(member: Path) -> bool:
    """Whether a stage of a member was trained anew after it had diverged.

    Args:
        member: directory of the member.
    """
    return any(member.glob(f"*{ASIDE}"))


def _aside(run: Path) -> Path:
    return run.with_name(run.name + ASIDE)
