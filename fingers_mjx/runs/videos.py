"""Where the videos of a run are: one for each iteration that was filmed."""

from pathlib import Path

FOLDER = "videos"
SUFFIX = ".gif"
"""What TensorBoard shows moving."""


def video_file(run_dir: Path, iteration: int) -> Path:
    """Returns where the video of an iteration is."""
    return run_dir / FOLDER / f"{iteration:08d}{SUFFIX}"


def video_files(run_dir: Path) -> dict[int, Path]:
    """Returns the videos of a run by iteration, oldest first."""
    found = sorted((run_dir / FOLDER).glob(f"*{SUFFIX}"))
    return {int(path.stem): path for path in found if path.stem.isdecimal()}


def policies_folder(run_dir: Path) -> Path:
    """Returns where the networks wait that are to be filmed."""
    return run_dir / FOLDER / "policies"
