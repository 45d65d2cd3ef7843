"""The page that shows a diagnosis: what differed, why, and what the cause explains."""

from collections.abc import Sequence
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
from sysid.diagnosis.diagnose import Examined
from sysid.diagnosis.replay.residuals import sample_rows
from sysid.diagnosis.verdict.closed_loop import simulated
from sysid.result import Diagnosis

SHOWN_S = 12.0
"""Length of the stretch that is drawn [s]."""

UNITS = {"speed": "rad/s, m/s", "angle": "rad, m", "effort": "N·m, N", "time": "s"}
"""Units of what a residual may depend on, of turning and sliding joints."""

BEFORE, AFTER, MEASURED = "#c44e52", "#4c72b0", "#222222"


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
    sections += [Section(f"Joint {e.track.joint}", _joint(e)) for e in shown[:3]]
    if diagnosis.warnings or diagnosis.unexplained:
        lines = [*diagnosis.warnings, *diagnosis.unexplained]
        sections.append(Section("Warnings", [Note("\n".join(lines))]))
    records = [Note("\n".join(f"record {x}" for x in diagnosis.log_sha256))]
    sections.append(Section("Provenance", records))
    return write_report(path, sections, f"Diagnosis: {diagnosis.verdict}")


def _verdict(diagnosis: Diagnosis) -> list:
    """Words, causes, gains and rivals."""
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
                  "unit", "evidence [nat]")  # fmt: skip
        blocks.append(Table(header, rows, "Causes in order of gain."))
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
        header = ("instead", "worse by [nat]", "told apart")
        blocks.append(Table(header, rows, "Rivals of the first cause."))
    if diagnosis.not_observable:
        names = ", ".join(diagnosis.not_observable)
        blocks.append(Note(f"These records could not have shown: {names}."))
    return blocks


def _joint(one: Examined) -> list[Picture]:
    """Measured against simulated, residuals, and what they depend on."""
    assert one.search is not None and one.problem is not None
    return [
        picture(_angles(one), "Measured and simulated angle, and their difference."),
        picture(_residuals(one), "Residuals on the measured motion, before and after."),
        picture(_features(one), "What the residual depends on: means over bins."),
    ]


def _window(one: Examined) -> tuple[int, slice]:
    """Returns the piece and the steps that are drawn: where the error is largest."""
    assert one.problem is not None and one.search is not None
    raw = one.problem.raw(one.search.base.fit.theta[None], weigh=False)[0]
    size = (raw**2).sum(0)
    piece = int(np.argmax(size.sum(0)))
    steps = round(SHOWN_S / one.track.dt)
    every = max(1, (len(one.track.track.cmd) - steps) // 20)
    starts = list(range(0, max(1, len(one.track.track.cmd) - steps), every))
    rows = sample_rows(len(one.track.track.cmd))
    inside = [size[(rows >= s) & (rows < s + steps), piece].sum() for s in starts]
    first = starts[int(np.argmax(inside))]
    return piece, slice(first, first + steps)


def _angles(one: Examined) -> Figure:
    """Closed loop: target, measured and simulated angle; error below."""
    assert one.problem is not None and one.search is not None
    piece, window = _window(one)
    models = (one.search.base, one.search.best)
    thetas = np.stack([m.fit.theta for m in models])
    angles = simulated(one.problem, thetas)[:, window, piece]
    t_s = one.track.dt * np.arange(window.start, window.start + angles.shape[1])
    measured = np.asarray(one.track.track.pos)[window, piece]
    figure = Figure(figsize=(9, 4.6), layout="constrained")
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    target = np.asarray(one.track.track.cmd)[window, piece]
    top.plot(t_s, target, ":", color="#999999", label="target")
    top.plot(t_s, measured, color=MEASURED, label="measured")
    for angle, color, name in zip(
        angles, (BEFORE, AFTER), ("before", "after"), strict=True
    ):
        top.plot(t_s, angle, color=color, lw=1, label=f"simulated {name}")
        bottom.plot(t_s, measured - angle, color=color, lw=1)
    top.legend(ncols=4, fontsize=8)
    top.set_ylabel("angle [rad, m]")
    bottom.set_ylabel("error [rad, m]")
    bottom.set_xlabel("time [s]")
    return figure


def _residuals(one: Examined) -> Figure:
    """Both residuals, before and after, over time."""
    assert one.problem is not None and one.search is not None
    piece, window = _window(one)
    rows = sample_rows(len(one.track.track.cmd))
    inside = (rows >= window.start) & (rows < window.stop)
    figure = Figure(figsize=(9, 3.6), layout="constrained")
    axes = figure.subplots(2, 1, sharex=True)
    for model, color in ((one.search.base, BEFORE), (one.search.best, AFTER)):
        raw = one.problem.raw(model.fit.theta[None], weigh=False)[0]
        for k, name in enumerate(("controller", "mechanics")):
            valid = one.problem.valid[k, inside, piece]
            shown = np.where(valid, raw[k, inside, piece], np.nan)
            axes[k].plot(one.track.dt * rows[inside], shown, color=color, lw=1)
            axes[k].set_ylabel(f"{name}\n[N·m, N]")
    axes[1].set_xlabel("time [s]")
    return figure


def _features(one: Examined) -> Figure:
    """Conditional means of the residuals over speed, angle, effort and time."""
    assert one.problem is not None and one.search is not None
    rows = sample_rows(len(one.track.track.cmd))
    track = one.track.track
    time_s = np.broadcast_to((one.track.dt * rows)[:, None], one.track.valid.shape)
    features = {
        "speed": np.asarray(track.slow_vel)[rows],
        "angle": np.asarray(track.pos)[rows],
        "effort": np.asarray(track.effort)[rows],
        "time": time_s,
    }
    figure = Figure(figsize=(9, 4.0), layout="constrained")
    axes = figure.subplots(2, 4, sharey="row")
    for model, color in ((one.search.base, BEFORE), (one.search.best, AFTER)):
        raw = one.problem.raw(model.fit.theta[None], weigh=False)[0]
        for k in range(2):
            valid = one.problem.valid[k]
            for axis, (name, feature) in zip(axes[k], features.items(), strict=True):
                if valid.any():
                    axis.plot(*_means(feature[valid], raw[k][valid]), color=color)
                axis.set_xlabel(f"{name} [{UNITS[name]}]", fontsize=8)
    for k, name in enumerate(("controller", "mechanics")):
        axes[k, 0].set_ylabel(f"{name} [N·m, N]")
    return figure


def _means(x: np.ndarray, y: np.ndarray, bins: int = 20):
    """Means of y over bins of x that hold equally many samples."""
    order = np.array_split(np.argsort(x), bins)
    kept = [i for i in order if i.size]
    return [x[i].mean() for i in kept], [y[i].mean() for i in kept]
