"""Files that commands read, looked at before JAX loads."""

from pathlib import Path

from envs.errors import InputError
from fingers_deploy.files import is_folder, open_regular

MAX_START_BYTES = 64 << 20


def check_hand(path: Path | None) -> None:
    """Refuses what is no hand file; one with effects loads JAX, for their names.

    Args:
        path: of the file; None, for the paper's hand, is not looked at.

    Raises:
        InputError: as `envs.hand.hand_file.load_hand_file`.
    """
    from envs.hand.hand_file import load_hand_file

    if path is not None:
        load_hand_file(path)


def check_start(path: Path | None) -> None:
    """Refuses a start of training that is not there; what it holds is read later.

    Args:
        path: that `--warm-start` gives, if any.

    Raises:
        InputError: it is neither a folder nor a regular file.
    """
    if path is None or is_folder(path):
        return
    if not path.exists():
        valid = "a run, a checkpoint or a bundle"
        raise InputError(path, "", "no such file or directory", valid)
    open_regular(path, MAX_START_BYTES).close()
