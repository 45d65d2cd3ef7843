"""The page of the safety table states the rules that the supervisor has."""

from dataclasses import replace
from pathlib import Path

from fingers_robot.safety import ROWS, Row

PAGE = Path(__file__).parents[3] / "docs" / "reference" / "safety-table.md"


def as_line(row: Row) -> str:
    then = ""
    if row.worse is not None:
        lasting = " if it lasts" if row.lasting else ""
        then = f"{row.worse.name.lower()} after {1e3 * row.after_s:.0f} ms{lasting}"
    within, reaction = f"{1e3 * row.within_s:.0f}", row.reaction.name.lower()
    cells = (row.id, row.name, row.rule, within, reaction, then, row.clear)
    return "| " + " | ".join(cells) + " |"


def rules() -> list[str]:
    section = PAGE.read_text("utf-8").split("\n## ")[1]
    return [x for x in section.splitlines() if x.startswith("|")][2:]


def test_the_page_has_every_rule_as_it_is():
    assert rules() == [as_line(row) for row in ROWS]


def test_a_changed_rule_would_be_found():
    """Negative control."""
    changed = replace(ROWS[0], within_s=2 * ROWS[0].within_s)
    assert as_line(changed) not in rules()
