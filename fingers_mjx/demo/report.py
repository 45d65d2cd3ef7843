"""The report of the demonstration: one page with tables, figures and the video."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from fingers_mjx.demo.learn import Learned
from fingers_mjx.demo.show import FILM, Shown
from fingers_mjx.evaluation.source import document, evaluation_figures
from fingers_mjx.evaluation.stats import summarize
from fingers_mjx.reports import figures
from fingers_mjx.reports import page as report
from fingers_mjx.runs.metrics import read_metrics

COMPARED = (
    "survival",
    "task_speed_mps",
    "path_speed_mps",
    "turn_rate_error_rad_s",
    "five_finger_participation",
    "mean_contact_tilt_deg",
    "cost_of_transport",
)
LEARNED = ("survival", "duration_s", "undesired_contact_rate")


def write_demo_report(
    path: Path, shown: Shown, learned: Learned, commands: Sequence[str]
) -> Path:
    """Writes the page.

    Args:
        path: HTML file to write.
        shown: the given policy.
        learned: the policy trained here.
        commands: that made it.
    """
    sections = [
        _walk(shown),
        _measures(shown),
        _loop(shown),
        _learning(learned),
        _export(learned),
        report.provenance(commands),
    ]
    return report.write_report(path, sections, "A hand that walks on its fingertips")


def _walk(shown: Shown) -> report.Section:
    words = ", then ".join(
        f"forward {x:g} m/s, left {y:g} m/s, turn {turn:g} rad/s" for x, y, turn in FILM
    )
    speed = shown.film.table.columns["path_speed_mps"][0]
    text = (
        "The exported policy drives the nominal hand in plain C MuJoCo through the "
        f"deployment shim, as it would drive the real hand. Commands: {words}. "
        f"Mean path speed {report.shown(float(speed))} m/s."
    )
    video = report.video(shown.video, "C MuJoCo at 200 Hz, policy at 50 Hz")
    return report.Section("The walk", [report.Note(text), video])


def _measures(shown: Shown) -> report.Section:
    table = shown.simulated
    summary = document(shown.source, table, 0, {})
    count = len(table.columns["survival"])
    caption = (
        f"{count} episodes of the training distribution: friction, stiffness, damping, "
        "torque, masses and sensors vary from hand to hand, commands change within "
        "each episode. Intervals are of the mean over episodes."
    )
    drawn = evaluation_figures(table)
    blocks = [
        report.measures_table(summary, caption),
        report.picture(drawn["gait"], "Contact of each fingertip with the floor"),
        report.picture(drawn["feet"], "Paths of the fingertips"),
        report.picture(drawn["tracking_in_time"], "One episode"),
        report.picture(drawn["tracking"], "All episodes"),
    ]
    return report.Section("In randomized worlds", blocks)


def _loop(shown: Shown) -> report.Section:
    ours, theirs = shown.simulated.columns, shown.played.table.columns
    rows = [_compared(name, ours[name], theirs[name]) for name in COMPARED]
    text = (
        "The same worlds, starts and commands twice: in the training environment, and "
        "in C MuJoCo with observations and targets made by fingers_deploy from the "
        f"bundle alone. The shim held its target in {shown.played.held} steps."
    )
    header = ("measure", "environment", "through the shim", "ratio", "episodes")
    blocks = [report.Note(text), report.Table(header, rows)]
    return report.Section("Through the deployment shim", blocks)


def _compared(
    name: str, ours: np.ndarray, theirs: np.ndarray
) -> tuple[report.Cell, ...]:
    """Returns the means over the episodes that both sides define."""
    both = np.isfinite(ours) & np.isfinite(theirs)
    if not both.any():
        return name, None, None, None, 0
    means = float(ours[both].mean()), float(theirs[both].mean())
    ratio = means[1] / means[0] if means[0] else None
    return name, *means, ratio, int(both.sum())


def _learning(learned: Learned) -> report.Section:
    rows = read_metrics(learned.run_dir / "metrics.jsonl")
    steps = rows[-1]["env_steps"]
    curves = figures.training_curves(
        {"training": rows},
        {
            "episode/return": "mean return",
            "episode/length": "mean length of an episode [steps]",
        },
        x="env_steps",
    )
    standing = figures.standing(
        {
            "before": np.asarray(learned.before.traces.failed),
            "after": np.asarray(learned.after.traces.failed),
        },
        learned.after.dt_s,
    )
    text = (
        f"From random networks to this in {steps:,} control steps, "
        f"{learned.trained_s:.0f} s on this machine, compilation included. The hand "
        "learns to stay on its feet while it tries out random motions; a gait takes "
        "some hundred times as many steps, which a GPU makes in minutes."
    )
    header = ("measure", "before", "95 % interval", "after", "95 % interval")
    table = report.Table(header, [_changed(n, learned) for n in LEARNED])
    blocks = [
        report.Note(text),
        report.picture(curves, "Learning curves"),
        report.picture(
            standing, "Randomized worlds, each policy with its exploration noise"
        ),
        table,
    ]
    return report.Section("Learning on this machine", blocks)


def _changed(name: str, learned: Learned) -> tuple[report.Cell, ...]:
    cells: list[report.Cell] = [name]
    for table in (learned.before, learned.after):
        found = summarize(table.columns[name])
        low, high = report.shown(found.low), report.shown(found.high)
        cells += [found.mean, f"{low} to {high}"]
    return tuple(cells)


def _export(learned: Learned) -> report.Section:
    found = learned.export
    rows = [("ONNX Runtime", found.onnxruntime), ("NumPy", found.numpy)]
    caption = (
        f"Largest difference of any action from JAX over {found.observations:,} "
        "observations; 1e-5 is the limit."
    )
    table = report.Table(("runtime", "difference"), rows, caption)
    where = report.Note(f"The bundle is in {learned.run_dir.name}.")
    return report.Section("Export of the new policy", [table, where])
