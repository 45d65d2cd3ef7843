"""Figures of an evaluation and of training: one function each, returning the Figure."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from jaxtyping import Bool, Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import EngFormatter

from envs.hand.nominal import FINGERS

# Okabe and Ito's palette, distinct for colour-blind readers.
FINGER_COLOURS = ("#D55E00", "#0072B2", "#009E73", "#CC79A7", "#E69F00")
INK, GREY = "#2b2f36", "#9aa1ab"
LINES = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", INK)

STYLE: Any = {
    "font.size": 9.5,
    "axes.edgecolor": GREY,
    "axes.labelcolor": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlesize": 10.5,
    "axes.grid": True,
    "grid.color": "#e4e7eb",
    "grid.linewidth": 0.8,
    "axes.axisbelow": True,
    "legend.frameon": False,
    "savefig.dpi": 150,
}


def gait_diagram(
    contact: Bool[np.ndarray, "T tips"], dt_s: float, title: str = "Gait diagram"
) -> Figure:
    """Draws a bar for every stretch of contact of each fingertip with the ground.

    Args:
        contact: which tips touch, per control step.
        dt_s: control interval.
        title: of the figure.
    """
    figure, (axes,) = panels_of(1, (7.6, 2.3))
    for tip, (name, colour) in _tips(contact):
        edges = np.flatnonzero(np.diff(contact[:, tip], prepend=False, append=False))
        bars = [((a * dt_s), (b - a) * dt_s) for a, b in edges.reshape(-1, 2)]
        axes.broken_barh(bars, (tip - 0.36, 0.72), color=colour)
        share = 100 * contact[:, tip].mean() if len(contact) else 0.0
        axes.text(1.01, tip, f"{share:.0f} %", transform=_row(axes), va="center")
        axes.text(-0.01, tip, name, transform=_row(axes), va="center", ha="right")
    axes.set(
        xlim=(0, max(len(contact), 1) * dt_s),
        ylim=(contact.shape[1] - 0.4, -0.6),
        yticks=[],
        title=title,
    )
    axes.set_xlabel("time [s]     (right: share of time in contact)")
    return figure


def foot_trajectories(
    tip_pos_v: Float[np.ndarray, "T tips 3"], contact: Bool[np.ndarray, "T tips"]
) -> Figure:
    """Draws each fingertip's path from the side (x, z) and from above (x, y).

    Strong lines are stance (contact), pale lines swing.

    Args:
        tip_pos_v: fingertips relative to the palm in V [m].
        contact: which tips touch, per control step.
    """
    figure, (side, top) = panels_of(2, (7.6, 3.4))
    for tip, (name, colour) in _tips(contact):
        path = 1000 * tip_pos_v[:, tip]
        stance = np.where(contact[:, tip, None], path, np.nan)
        for axes, row in ((side, 2), (top, 1)):
            axes.plot(path[:, 0], path[:, row], color=colour, alpha=0.35, lw=0.8)
            axes.plot(stance[:, 0], stance[:, row], color=colour, lw=1.8, label=name)
    side.set(xlabel="x forward [mm]", ylabel="z up [mm]", title="side view")
    top.set(xlabel="x forward [mm]", ylabel="y left [mm]", title="top view")
    side.set_aspect("equal", adjustable="datalim")
    top.set_aspect("equal", adjustable="datalim")
    figure.suptitle("Fingertip paths relative to the palm, frame V", fontsize=10.5)
    handles, labels = top.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=5)
    return figure


def _tips(
    contact: Bool[np.ndarray, "T tips"],
) -> Iterable[tuple[int, tuple[str, str]]]:
    """Each fingertip's place with its name and colour."""
    count = contact.shape[1]
    named = zip(FINGERS[:count], FINGER_COLOURS[:count], strict=True)
    return enumerate(named)


def tracking(columns: Mapping[str, Float[np.ndarray, " episodes"]]) -> Figure:
    """Draws speed and turn rate against their commands; the dashed line is ideal.

    Args:
        columns: of an episode table; read are command_speed_mps, task_speed_mps,
            command_turn_rate_rad_s and turn_rate_rad_s.
    """
    figure, (speed, turn) = panels_of(2, (7.6, 3.4))
    speeds = columns["command_speed_mps"], columns["task_speed_mps"]
    turns = columns["command_turn_rate_rad_s"], columns["turn_rate_rad_s"]
    _against(speed, *speeds, LINES[0])
    _against(turn, *turns, LINES[1])
    speed.set(xlabel="mean commanded speed [m/s]", ylabel="task speed [m/s]")
    turn.set(xlabel="mean commanded turn rate [rad/s]", ylabel="mean turn rate [rad/s]")
    figure.suptitle("Achieved against commanded, one dot per episode", fontsize=10.5)
    return figure


def tracking_in_time(
    command: Float[np.ndarray, "T 3"],
    vel_v: Float[np.ndarray, "T 2"],
    yaw_rate: Float[np.ndarray, " T"],
    dt_s: float,
    title: str = "Velocity of one episode against its command",
) -> Figure:
    """Draws forward, lateral and turning velocity over time with their commands.

    Thin lines are every control step, strong lines one-second means.

    Args:
        command: v_x, v_y [m/s] and yaw rate [rad/s].
        vel_v: planar velocity of the palm in V [m/s].
        yaw_rate: of the palm in V [rad/s].
        dt_s: control interval.
        title: of the figure.
    """
    figure, rows = panels_of(3, (7.6, 4.6), rows=3)
    achieved = np.column_stack([vel_v, yaw_rate])
    time = dt_s * (1 + np.arange(len(command)))
    names = ("forward [m/s]", "left [m/s]", "turn [rad/s]")
    for row, (axes, name) in enumerate(zip(rows, names, strict=True)):
        axes.plot(time, achieved[:, row], color=LINES[row], lw=0.6, alpha=0.35)
        smooth = _moving_mean(achieved[:, row], round(1.0 / dt_s))
        axes.plot(time, smooth, color=LINES[row], lw=1.8, label="achieved (1 s mean)")
        axes.plot(time, command[:, row], color=INK, lw=1.2, ls="--", label="commanded")
        spread = np.abs(np.concatenate([smooth, command[:, row], [0.02]])).max()
        axes.set(ylabel=name, ylim=(-1.9 * spread, 1.9 * spread))
    rows[0].legend(ncols=2, loc="upper right")
    rows[0].set_title(title)
    rows[-1].set_xlabel("time [s]")
    return figure


def training_curves(
    runs: Mapping[str, Sequence[Mapping[str, float]]],
    metrics: Mapping[str, str],
    x: str = "steps",
) -> Figure:
    """Draws one panel per metric and one line per run.

    Rows without the metric are passed over, so that rare metrics (such as evaluations)
    are drawn from the rows that have them.

    Args:
        runs: name of a run to its rows of `metrics.jsonl`.
        metrics: key in the rows to label with unit, in the order of panels.
        x: key of the horizontal axis, which counts environment steps.

    Examples:
        >>> rows = [{"steps": 1000 * i, "return": 0.1 * i} for i in range(5)]
        >>> figure = training_curves({"seed 0": rows}, {"return": "return [1]"})
        >>> figure.axes[0].get_ylabel()
        'return [1]'
    """
    figure, panels = panels_of(len(metrics), (3.8 * len(metrics), 3.0))
    for axes, (key, label) in zip(panels, metrics.items(), strict=True):
        for (name, rows), colour in zip(runs.items(), _cycle(len(runs)), strict=True):
            points = [(row[x], row[key]) for row in rows if key in row and x in row]
            axes.plot(*np.reshape(points, (-1, 2)).T, color=colour, lw=1.6, label=name)
        axes.set(xlabel="environment steps", ylabel=label)
        axes.xaxis.set_major_formatter(EngFormatter(sep=" "))
        axes.locator_params(axis="x", nbins=5)
    if len(runs) > 1:
        panels[0].legend()
    return figure


def standing(
    failed: Mapping[str, Bool[np.ndarray, "T episodes"]], dt_s: float
) -> Figure:
    """Draws the fraction of episodes without a fall yet, over time, for each policy.

    Args:
        failed: name of a policy to whether each episode failed in each step.
        dt_s: control interval.
    """
    figure, (axes,) = panels_of(1, (7.6, 2.8))
    for (name, fell), colour in zip(failed.items(), _cycle(len(failed)), strict=True):
        share = 1.0 - np.maximum.accumulate(fell, axis=0).mean(axis=1)
        time = dt_s * (1 + np.arange(len(share)))
        axes.plot(time, 100 * share, color=colour, lw=1.8, label=name)
    axes.set(xlabel="time [s]", ylabel="standing [%]", ylim=(-3, 103))
    axes.set_title("Episodes without a fall")
    axes.legend()
    return figure


def panels_of(
    count: int, size: tuple[float, float], rows: int = 1, shared: bool = True
) -> tuple[Figure, list[Axes]]:
    """Returns an Agg figure of its own: no pyplot state, nothing to close.

    Args:
        count: of panels, a multiple of `rows`.
        size: width and height [inch].
        rows: of panels.
        shared: whether panels of several rows have one horizontal axis.
    """
    sharex = shared and rows > 1
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=size, layout="constrained")
        panels = figure.subplots(rows, count // rows, squeeze=False, sharex=sharex)
    return figure, list(panels.flat)


def _row(axes: Axes):
    """Returns the transform with x in fractions of the axes and y in data."""
    return axes.get_yaxis_transform()


def _against(axes: Axes, wanted: np.ndarray, got: np.ndarray, colour: str) -> None:
    both = np.concatenate([wanted, got])
    both = both[np.isfinite(both)]
    if len(both):
        span = [both.min(), both.max()]
        axes.plot(span, span, color=INK, ls="--", lw=1.0)
    axes.plot(wanted, got, "o", color=colour, alpha=0.55, ms=4, mew=0)


def _moving_mean(values: np.ndarray, span: int) -> np.ndarray:
    kernel = np.ones(max(1, min(span, len(values))))
    count = np.convolve(np.ones(len(values)), kernel, mode="same")
    return np.convolve(values, kernel, mode="same") / count


def _cycle(count: int) -> list[str]:
    return [LINES[i % len(LINES)] for i in range(count)]
