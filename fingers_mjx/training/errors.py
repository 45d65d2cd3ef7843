"""Ways a training run can end early; each knows its exit status."""

from pathlib import Path

from envs.errors import BAD_INPUT, InputError
from fingers_deploy import BundleError
from fingers_mjx.runs.files import OutOfSpace, is_full


class Diverged(RuntimeError):
    """Learning broke down: too many updates in a row were not finite (status 3).

    Args:
        term: first non-finite term, such as "loss/value" or "params/policy/…".
        iteration: iteration in which the streak of bad updates began.
        skipped: number of bad updates in a row.
        dump: file with the state, all of it from before the first bad update.
        checkpoint: newest complete checkpoint, if there is one.
    """

    exit_code = 3

    def __init__(
        self,
        term: str,
        iteration: int,
        skipped: int,
        dump: Path,
        checkpoint: Path | None,
    ):
        self.term, self.iteration, self.skipped = term, iteration, skipped
        self.dump, self.checkpoint = dump, checkpoint
        good = f"last checkpoint {checkpoint}" if checkpoint else "no checkpoint yet"
        super().__init__(
            f"diverged at iteration {iteration}: {term} is not finite, {skipped} "
            f"updates in a row skipped; state saved in {dump}; {good}"
        )


class Interrupted(RuntimeError):
    """A signal stopped the run after a checkpoint was written (status 75)."""

    exit_code = 75

    def __init__(self, checkpoint: Path, iteration: int):
        self.checkpoint, self.iteration = checkpoint, iteration
        super().__init__(
            f"stopped after iteration {iteration}; saved in {checkpoint}; "
            "go on with --resume"
        )


def exit_status(error: Exception) -> int | None:
    """Returns the exit status of an error that a user can meet, None for a fault."""
    if (status := getattr(error, "exit_code", None)) is not None:
        return status
    if is_full(error):
        return OutOfSpace.exit_code
    return BAD_INPUT if isinstance(error, InputError | BundleError | OSError) else None
