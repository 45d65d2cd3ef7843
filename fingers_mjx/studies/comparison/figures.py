"""Figures of a comparison: seeds of every configuration, and learning curves."""

from collections.abc import Mapping, Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fingers_mjx.reports.figures import INK, LINES, panels_of
from fingers_mjx.studies.comparison.comparison import Cell, Comparison
from fingers_mjx.studies.comparison.curves import STEPS, Curve, band

ACROSS = 3
"""Panels side by side."""

SHOWN = {"episode/return": "return", "episode/length": "episode length [steps]"}
"""What is drawn over training."""


def seed_dots(comparison: Comparison) -> Figure:
    """Draws every seed, and mean with 95 % interval of every configuration.

    Args:
        comparison: of a sweep.
    """
    names = comparison.results.configurations
    colours = _colours(names, comparison.baseline)
    rows = -(-len(comparison.measures) // ACROSS)
    across = min(ACROSS, len(comparison.measures))
    size = (1.6 + 2.7 * across, rows * (0.8 + 0.34 * len(names)))
    figure, panels = panels_of(rows * across, size, rows, shared=False)
    for axes in panels[len(comparison.measures) :]:
        axes.set_visible(False)
    for index, measure in enumerate(comparison.measures):
        axes = panels[index]
        for place, name in enumerate(names):
            _dots(axes, place, comparison.cell(name, measure), colours[name])
        labels = names if index % across == 0 else [""] * len(names)
        axes.set_yticks(range(len(names)), labels)
        axes.set(ylim=(len(names) - 0.4, -0.6), xlabel=measure)
        axes.margins(x=0.08)
        axes.grid(visible=False, axis="y")
    return figure


def _dots(axes: Axes, place: int, cell: Cell, colour: str) -> None:
    """One configuration: seeds above, mean and interval below."""
    seeds = [value for value in cell.values.values() if value is not None]
    heights = [place - 0.16] * len(seeds)
    axes.plot(seeds, heights, "o", color=colour, alpha=0.6, ms=4.5, mew=0)
    if cell.arm.mean is None:
        return
    if cell.arm.low is not None and cell.arm.high is not None:
        ends = [cell.arm.low, cell.arm.high]
        axes.plot(ends, [place + 0.16] * 2, color=colour, lw=2.2)
    axes.plot(cell.arm.mean, place + 0.16, "D", color=colour, ms=5, mec="white")


def learning_curves(curves: Sequence[Curve], comparison: Comparison) -> Figure:
    """Draws mean and band over seeds of each configuration, and every seed thinly.

    Members that did not finish are dotted and not in the mean.

    Args:
        curves: of the members.
        comparison: of the same sweep.
    """
    names = comparison.results.configurations
    colours = _colours(names, comparison.baseline)
    figure, panels = panels_of(len(SHOWN), (9.6, 3.4), 1)
    for axes, (metric, label) in zip(panels, SHOWN.items(), strict=True):
        for name in names:
            own = [c for c in curves if c.configuration == name]
            _curve(axes, own, metric, colours[name])
        axes.set(xlabel=f"control steps ({STEPS})", ylabel=label)
    for name in names:
        panels[0].plot([], [], color=colours[name], lw=1.8, label=name)
    handles, labels = panels[0].get_legend_handles_labels()
    below = {"loc": "outside lower center", "frameon": False}
    figure.legend(handles, labels, ncols=min(4, len(names)), **below)
    return figure


def _curve(axes: Axes, curves: Sequence[Curve], metric: str, colour: str) -> None:
    """One configuration in one panel."""
    for curve in curves:
        style = "-" if curve.done else ":"
        axes.plot(*curve.of(metric), style, color=colour, lw=0.7, alpha=0.4)
    found = band([c for c in curves if c.done], metric)
    if found is not None:
        ends = (found.low, found.high)
        axes.fill_between(found.steps, *ends, color=colour, alpha=0.18, lw=0)
        axes.plot(found.steps, found.mean, color=colour, lw=1.8)


def _colours(names: Sequence[str], baseline: str) -> Mapping[str, str]:
    """The baseline dark, the others in turn."""
    others = [name for name in names if name != baseline]
    palette = [colour for colour in LINES if colour != INK]
    turn = {n: palette[i % len(palette)] for i, n in enumerate(others)}
    return {**turn, baseline: INK}
