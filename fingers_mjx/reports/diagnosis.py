"""The page that shows a diagnosis: what differed, why, and what the cause explains."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from fingers_mjx.reports.page import (
    Note,
    Picture,
    Section,
    Table,
    picture,
    write_report,
)
from sysid.diagnosis.fits.problem import Problem
from sysid.diagnosis.replay.band import sample_rows
from sysid.diagnosis.replay.motion import JointTrack
from sysid.diagnosis.search.search import Examined
from sysid.diagnosis.simulated.closed_loop import simulated
from sysid.diagnosis.verdict.wording import probable
from sysid.result import Diagnosis

SHOWN_S = 12.0
"""Length of the stretch that is drawn [s]."""

UNITS = {"speed": "rad/s, m/s", "angle": "rad, m", "effort": "N·m, N", "time": "s"}
"""Units of what a residual may depend on, of turning and sliding joints."""

KINDS = ("controller", "mechanics")
COLOURS = {"before": "#c44e52", "after": "#4c72b0"}
MEASURED = "#222222"


@dataclass(frozen=True, eq=False)
class _Joint:
    """One joint and what is drawn of it.

    Attributes:
        track: its measured motion.
        problem: residuals and weights.
        thetas: parameters before and after.
        raw: residuals (controller, mechanics) under both.
        rows: steps at which residuals are sampled.
        piece: the piece that is drawn.
        window: the steps that are drawn, where the error is largest.
    """

    track: JointTrack
    problem: Problem
    thetas: np.ndarray
    raw: tuple[np.ndarray, ...]
    rows: np.ndarray
    piece: int
    window: slice


def write_diagnosis_report(
    path: Path, diagnosis: Diagnosis, examined: Sequence[Examined]
) -> Path:
    """Writes one self-contained page.

    Args:
        path: HTML file to write.
        diagnosis: the verdict.
        examined: what was done with every joint.
    """
    sections = [Section("Verdict", _verdict(diagnosis))]
    shown = [e for e in examined if e.search is not None]
    shown.sort(key=lambda e: -len(e.search.best.effects) if e.search else 0)
    sections += [Section(f"Joint {e.track.joint}", _pictures(e)) for e in shown[:3]]
    if diagnosis.warnings or diagnosis.unexplained:
        lines = [*diagnosis.warnings, *diagnosis.unexplained]
        sections.append(Section("Warnings", [Note("\n".join(lines))]))
    records = [Note("\n".join(f"record {x}" for x in diagnosis.log_sha256))]
    sections.append(Section("Provenance", records))
    return write_report(path, sections, f"Diagnosis: {diagnosis.verdict}")


def _verdict(diagnosis: Diagnosis) -> list:
    """Summary, causes, gains and alternatives."""
    blocks: list = [Note(diagnosis.summary)]
    if diagnosis.next_experiment:
        blocks.append(Note(f"Record next. {diagnosis.next_experiment}"))
    if diagnosis.causes:
        rows = [
            (c.effect, c.where, name, e.value, e.low, e.high, e.unit, c.evidence)
            for c in diagnosis.causes
            for name, e in c.parameters.items()
        ]
        header = ("cause", "where", "parameter", "value", "95 % low", "95 % high",
                  "unit", "log-likelihood gain")  # fmt: skip
        blocks.append(Table(header, rows, "Causes in order of gain."))
    if said := probable(diagnosis.posterior):
        caption = "Of the joints that may have an effect; calibrated on hidden cases."
        blocks.append(Table(("joint", "hypothesis", "probability"), said, caption))
    if diagnosis.residual_gains:
        rows = [
            (n, g.heldout_rmse_before, g.heldout_rmse_after, g.noise_floor,
             g.explained_fraction, g.low, g.high, g.unit)
            for n, g in diagnosis.residual_gains.items()
        ]  # fmt: skip
        header = ("residual", "before", "after", "noise floor", "explained",
                  "95 % low", "95 % high", "unit")  # fmt: skip
        caption = "Root mean square on data that no fit saw."
        blocks.append(Table(header, rows, caption))
    if diagnosis.alternatives:
        rows = [
            (a.effect, a.score_gap, "yes" if a.distinguishable else "no")
            for a in diagnosis.alternatives
        ]
        header = ("instead", "log-likelihood lost", "distinguishable")
        blocks.append(Table(header, rows, "Alternatives to the first cause."))
    if diagnosis.not_observable:
        names = ", ".join(diagnosis.not_observable)
        blocks.append(Note(f"These records could not have shown: {names}."))
    return blocks


def diagnosis_figures(one: Examined) -> dict[str, Figure]:
    """Draws what was done with a joint that moved; by caption.

    Args:
        one: from `sysid.diagnosis.diagnose.examine`, with a search.
    """
    joint = _joint(one)
    return {
        "Measured and simulated angle, and their difference.": _angles(joint),
        "Residuals on the measured motion, before and after.": _residuals(joint),
        "What the residual depends on: means over bins.": _features(joint),
    }


def _pictures(one: Examined) -> list[Picture]:
    return [picture(drawn, words) for words, drawn in diagnosis_figures(one).items()]


def _joint(one: Examined) -> _Joint:
    """Finds the piece and the steps where the error before is largest."""
    assert one.problem is not None and one.search is not None
    thetas = np.stack([m.fit.theta for m in (one.search.base, one.search.best)])
    raw = tuple(one.problem.raw(theta[None], weigh=False)[0] for theta in thetas)
    size = (raw[0] ** 2).sum(0)
    piece, count = int(np.argmax(size.sum(0))), len(one.track.track.cmd)
    steps = round(SHOWN_S / one.track.dt)
    starts = range(0, max(1, count - steps), max(1, (count - steps) // 20))
    rows = sample_rows(count)
    inside = [size[(rows >= s) & (rows < s + steps), piece].sum() for s in starts]
    first = starts[int(np.argmax(inside))]
    window = slice(first, first + steps)
    return _Joint(one.track, one.problem, thetas, raw, rows, piece, window)


def _angles(joint: _Joint) -> Figure:
    """Closed loop: target, measured and simulated angle; error below."""
    track, piece, window = joint.track.track, joint.piece, joint.window
    angles = simulated(joint.problem, joint.thetas)[:, window, piece]
    t_s = joint.track.dt * np.arange(window.start, window.start + angles.shape[1])
    measured = np.asarray(track.pos)[window, piece]
    figure = Figure(figsize=(9, 4.6), layout="constrained")
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    target = np.asarray(track.cmd)[window, piece]
    top.plot(t_s, target, ":", color="#999999", label="target")
    top.plot(t_s, measured, color=MEASURED, label="measured")
    for angle, (name, color) in zip(angles, COLOURS.items(), strict=True):
        top.plot(t_s, angle, color=color, lw=1, label=f"simulated {name}")
        bottom.plot(t_s, measured - angle, color=color, lw=1)
    top.legend(ncols=4, fontsize=8)
    top.set_ylabel("angle [rad, m]")
    bottom.set_ylabel("error [rad, m]")
    bottom.set_xlabel("time [s]")
    return figure


def _residuals(joint: _Joint) -> Figure:
    """Both residuals, before and after, over time."""
    rows, window = joint.rows, joint.window
    inside = (rows >= window.start) & (rows < window.stop)
    figure = Figure(figsize=(9, 3.6), layout="constrained")
    axes = figure.subplots(2, 1, sharex=True)
    for raw, color in zip(joint.raw, COLOURS.values(), strict=True):
        for k, name in enumerate(KINDS):
            valid = joint.problem.valid[k, inside, joint.piece]
            shown = np.where(valid, raw[k, inside, joint.piece], np.nan)
            axes[k].plot(joint.track.dt * rows[inside], shown, color=color, lw=1)
            axes[k].set_ylabel(f"{name}\n[N·m, N]")
    axes[1].set_xlabel("time [s]")
    return figure


def _features(joint: _Joint) -> Figure:
    """Conditional means of the residuals over speed, angle, effort and time."""
    rows, track = joint.rows, joint.track.track
    time_s = (joint.track.dt * rows)[:, None]
    features = {
        "speed": np.asarray(track.slow_vel)[rows],
        "angle": np.asarray(track.pos)[rows],
        "effort": np.asarray(track.effort)[rows],
        "time": np.broadcast_to(time_s, joint.track.valid.shape),
    }
    figure = Figure(figsize=(9, 4.0), layout="constrained")
    axes = figure.subplots(2, 4, sharey="row")
    for raw, color in zip(joint.raw, COLOURS.values(), strict=True):
        for k, valid in enumerate(joint.problem.valid[:2]):
            for axis, (name, feature) in zip(axes[k], features.items(), strict=True):
                if valid.any():
                    axis.plot(*_means(feature[valid], raw[k][valid]), color=color)
                axis.set_xlabel(f"{name} [{UNITS[name]}]", fontsize=8)
    for k, name in enumerate(KINDS):
        axes[k, 0].set_ylabel(f"{name} [N·m, N]")
    return figure


def _means(x: np.ndarray, y: np.ndarray, bins: int = 20):
    """Means of y over bins of x that hold equally many samples."""
    order = np.array_split(np.argsort(x), bins)
    kept = [i for i in order if i.size]
    return [x[i].mean() for i in kept], [y[i].mean() for i in kept]
