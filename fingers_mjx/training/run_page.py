"""The page of a run: its learning curve and its latest videos."""

from pathlib import Path

from fingers_mjx.reports.figures import training_curves
from fingers_mjx.reports.page import Block, Note, Section, picture, write_report
from fingers_mjx.runs.metrics import read_metrics
from fingers_mjx.runs.videos import video_files

PAGE = "report.html"
CURVES = {
    "episode/return": "mean return",
    "episode/length": "mean length of an episode [steps]",
}
LATEST = 6
"""Videos on the page; all are in the run's folder."""


def write_run_page(run_dir: Path) -> Path:
    """Writes `report.html` of a run as it is now.

    Args:
        run_dir: run directory.
    """
    rows = read_metrics(run_dir / "metrics.jsonl")
    curve: list[Block] = [Note("No row of metrics yet.")]
    if rows:
        curve = [picture(training_curves({run_dir.name: rows}, CURVES, "env_steps"))]
    videos = list(video_files(run_dir).items())[-LATEST:]
    films: list[Block] = [
        picture(path, f"iteration {iteration}") for iteration, path in reversed(videos)
    ]
    sections = [Section("Learning curve", curve), Section("Latest videos", films)]
    return write_report(run_dir / PAGE, sections, run_dir.absolute().name)
