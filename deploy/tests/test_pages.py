"""What the documents say was measured is what was measured."""

from dataclasses import replace
from pathlib import Path

import pytest
from faults.matrix import as_markdown
from goals import goals
from report import page, read_results

ROOT = Path(__file__).parents[2]
RESULTS = ROOT / "deploy" / "benchmarks" / "results"


@pytest.fixture(scope="module")
def results():
    return read_results(RESULTS)


def test_the_pages_are_written_from_the_results_alone(results):
    docs = ROOT / "docs"
    assert (docs / "deploy-results.md").read_text("utf-8") == page(results)
    table = as_markdown(results.faults)
    assert (docs / "safety-table.md").read_text("utf-8") == table


def test_what_was_missed_is_said_with_a_reason(results):
    missed = [goal for goal in goals(results) if not goal.met]
    assert all(goal.why for goal in missed), missed


def test_a_worse_result_would_be_a_miss(results):
    """Negative control: each of these lines turns."""
    met = {goal.what for goal in goals(results) if goal.met}
    faults = results.faults
    row = faults["matrix"][0]
    worse = replace(
        results,
        step=[step | {"median_ms": 0.6} for step in results.step],
        fuzz=results.fuzz | {"accepted": 1},
        faults=faults
        | {
            "matrix": [row | {"passed": row["passed"] - 1}, *faults["matrix"][1:]],
            "fault_free": {"hours": 1.0, "false_trips": 1},
        },
    )
    turned = met - {goal.what for goal in goals(worse) if goal.met}
    assert len(turned) == len(results.step) + 3
