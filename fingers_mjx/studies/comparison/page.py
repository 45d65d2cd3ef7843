"""The page of a comparison: differences, seeds, learning curves, what is missing."""

from collections.abc import Sequence
from pathlib import Path

from fingers_mjx.reports.page import (
    Block,
    Note,
    Section,
    Table,
    picture,
    provenance,
    write_report,
)
from fingers_mjx.studies.comparison.comparison import Comparison
from fingers_mjx.studies.comparison.curves import Curve
from fingers_mjx.studies.comparison.figures import (
    difference_dots,
    learning_curves,
    seed_dots,
)
from fingers_mjx.studies.comparison.tables import (
    HEADER,
    arm_rows,
    difference_rows,
    interval,
    notes,
    short,
)

PAGE_FILE = "comparison.html"

READING = (
    "Difference: configuration less baseline on the same seed, mean over the seeds of "
    "both, with Student's interval. An arrow shows which direction is better.",
    "In favour: seeds on which the configuration is better, of those of both.",
    "P(better): probability of improvement, that a training of the configuration, with "
    "any seed, is better than one of the baseline, with any seed; ½ is no difference.",
    "p, Holm: paired t test over seeds, corrected for all comparisons on this page; "
    "below 0.05 a difference is significant however many were made.",
    "Detectable: the true difference that a test of so many seeds, read alone, finds "
    "in 80 % of studies, by the spread seen here. Smaller ones were not to be seen, "
    "which does not show that there are none.",
    "Seeds are resampled and counted, never episodes: these say how well a policy is "
    "measured, not what another training would bring.",
)


def write_page(
    path: Path,
    comparison: Comparison,
    curves: Sequence[Curve],
    commands: Sequence[str],
) -> Path:
    """Writes one self-contained page.

    Args:
        path: HTML file to write.
        comparison: of a sweep.
        curves: learning curves of its members.
        commands: that made the page.
    """
    baseline = comparison.baseline
    differences: list[Block] = [
        Note("\n".join(notes(comparison))),
        Table(HEADER, difference_rows(comparison), f"Against {baseline}."),
    ]
    dots = "Dots: seeds. Below them their mean and its 95 % interval."
    paired = f"The same of the differences from {baseline} on equal seeds."
    sections = [
        Section("Differences", differences),
        Section(
            "Seeds",
            [
                picture(seed_dots(comparison), dots),
                picture(difference_dots(comparison), paired),
            ],
        ),
        Section("Learning curves", _curves(comparison, curves)),
        Section("Configurations", _configurations(comparison)),
        Section("Missing", _missing(comparison)),
        Section("How to read this", [Note("\n".join(READING))]),
        provenance(commands),
    ]
    title = f"{comparison.results.task}: {len(comparison.results.configurations)} "
    return write_report(path, sections, f"{title}configurations against {baseline}")


def _curves(comparison: Comparison, curves: Sequence[Curve]) -> list[Block]:
    figure = learning_curves(curves, comparison)
    if figure is None:
        return [Note("No member has a learning curve.")]
    caption = (
        "Thin: seeds; dotted where the training is not done. Thick: mean over the "
        "seeds that are done, with its pointwise 95 % interval, as far as all of them "
        "have come. Returns of different rewards cannot be compared."
    )
    return [picture(figure, caption)]


def _configurations(comparison: Comparison) -> list[Block]:
    """Every configuration by itself, and the bootstrap beside Student's interval."""
    header = ("measure", "configuration", "seeds", "mean", "95 % interval",
              "interquartile mean", "95 % interval, BCa")  # fmt: skip
    bca = [
        (
            row.measure,
            row.configuration,
            interval(row.difference.low, row.difference.high),
            interval(row.difference.bca_low, row.difference.bca_high),
            short(row.difference.p),
        )
        for row in comparison.rows
    ]
    caption = (
        "Mean difference again, with the BCa bootstrap over seeds beside it, and p "
        "before the correction for several comparisons. With few "
        "seeds the bootstrap covers the truth less often than it says: in 74, 90 and "
        "93.5 % of normal studies of 3, 5 and 12 seeds."
    )
    return [
        Table(header, arm_rows(comparison)),
        Table(("measure", "configuration", "Student", "BCa", "p"), bca, caption),
        Table(("configuration", "seeds", "control steps"), _steps(comparison)),
    ]


def _steps(comparison: Comparison) -> list[tuple[str, str, str]]:
    """Which seeds a configuration has, and how long they were trained."""
    rows = []
    for name in comparison.results.configurations:
        trained = comparison.results.steps.get(name, {})
        lengths = sorted({f"{steps:,}" for steps in trained.values()})
        seeds = ", ".join(map(str, sorted(trained)))
        rows.append((name, seeds or "none", " or ".join(lengths)))
    return rows


def _missing(comparison: Comparison) -> list[Block]:
    if not comparison.missing:
        return [Note("Nothing: every member of the sweep is in the tables.")]
    rows = [(m.configuration, str(m.seed), m.reason) for m in comparison.missing]
    return [Table(("configuration", "seed", "what became of it"), rows)]
