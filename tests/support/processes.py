"""Whether a process that is no child of this one is still there."""

from pathlib import Path


def alive(pid):
    """Whether a process runs: one that only waits for its parent to ask does not."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")")[-1].split()[0] != "Z"
    except OSError:
        return False
