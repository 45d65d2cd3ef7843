"""Figures of a comparison: seeds of every configuration, and learning curves."""

from collections.abc import Mapping, Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from fingers_mjx.reports.figures import INK, LINES, panels_of
from fingers_mjx.studies.comparison.comparison import Comparison
from fingers_mjx.studies.comparison.curves import STEPS, Curve, band
from fingers_mjx.studies.statistics.compare import Arm, Difference

ACROSS = 3
"""Panels side by side."""

WIDTH = 9.6
"""Of every figure [inch], so that all have letters of one size."""

SHOWN = {"episode/return": "return", "episode/length": "episode length [steps]"}
"""What is drawn over training."""


def seed_dots(comparison: Comparison) -> Figure:
    """Draws every seed, and mean with 95 % interval of every configuration.

    Args:
        comparison: of a sweep.
    """
    names = comparison.results.configurations
    figure, panels = _panels(comparison, names)
    colours = _colours(names, comparison.baseline)
    for measure, axes in panels.items():
        for place, name in enumerate(names):
            cell = comparison.cell(name, measure)
            seeds = [value for value in cell.values.values() if value is not None]
            _dots(axes, place, seeds, cell.arm, colours[name])
    return figure


def difference_dots(comparison: Comparison) -> Figure:
    """Draws the difference from the baseline on every seed, its mean and interval.

    Args:
        comparison: of a sweep.
    """
    names = list(dict.fromkeys(row.configuration for row in comparison.rows))
    figure, panels = _panels(comparison, names)
    colours = _colours(comparison.results.configurations, comparison.baseline)
    for axes in panels.values():
        axes.plot([0.0, 0.0], [-1, len(names)], color=INK, lw=1.0, ls="--")
    for row in comparison.rows:
        ours, base = (
            comparison.cell(name, row.measure).values
            for name in (row.configuration, comparison.baseline)
        )
        both = [(ours[seed], base[seed]) for seed in ours.keys() & base.keys()]
        seeds = [x - y for x, y in both if x is not None and y is not None]
        where = (panels[row.measure], names.index(row.configuration), seeds)
        _dots(*where, row.difference, colours[row.configuration])
    return figure


def _panels(
    comparison: Comparison, names: Sequence[str]
) -> tuple[Figure, dict[str, Axes]]:
    """One panel for each measure, with a row for each configuration."""
    count = len(comparison.measures)
    across, rows = min(ACROSS, count), -(-count // ACROSS)
    size = (WIDTH, rows * (0.8 + 0.34 * len(names)))
    figure, panels = panels_of(rows * across, size, rows, shared=False)
    for axes in panels[count:]:
        axes.set_visible(False)
    found = dict(zip(comparison.measures, panels, strict=False))
    for index, (measure, axes) in enumerate(found.items()):
        labels = names if index % across == 0 else [""] * len(names)
        axes.set_yticks(range(len(names)), labels)
        axes.set(ylim=(len(names) - 0.4, -0.6), xlabel=measure)
        axes.xaxis.set_major_locator(MaxNLocator(4))
        axes.margins(x=0.08)
        axes.grid(visible=False, axis="y")
    return figure, found


def _dots(
    axes: Axes, place: int, seeds: Sequence[float], of: Arm | Difference, colour: str
) -> None:
    """One configuration: seeds above, mean and interval below."""
    above, below = place - 0.16, place + 0.16
    axes.plot(seeds, [above] * len(seeds), "o", color=colour, alpha=0.6, ms=4.5, mew=0)
    if of.low is not None and of.high is not None:
        axes.plot([of.low, of.high], [below] * 2, color=colour, lw=2.2)
    if of.mean is not None:
        axes.plot(of.mean, below, "D", color=colour, ms=5, mec="white")


def learning_curves(curves: Sequence[Curve], comparison: Comparison) -> Figure | None:
    """Draws mean and band over seeds of each configuration, and every seed thinly.

    Members that did not finish are dotted and not in the mean. None if no curve has
    anything that is drawn.

    Args:
        curves: of the members.
        comparison: of the same sweep.
    """
    names = comparison.results.configurations
    colours = _colours(names, comparison.baseline)
    found = [m for m in SHOWN if any(len(curve.of(m)[0]) for curve in curves)]
    if not found:
        return None
    figure, panels = panels_of(len(found), (WIDTH, 3.4))
    for axes, metric in zip(panels, found, strict=True):
        for name in names:
            own = [c for c in curves if c.configuration == name]
            _curve(axes, own, metric, colours[name])
        axes.set(xlabel=f"control steps ({STEPS})", ylabel=SHOWN[metric])
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
