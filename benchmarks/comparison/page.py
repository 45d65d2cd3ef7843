"""The table of the page `docs/results/comparison.md`, made from the committed rows.

    python -m benchmarks.comparison.page benchmarks/results/comparison-cpu.jsonl

Rewrites what stands between the two marks of the page and nothing else.
"""

import argparse
from collections.abc import Iterable
from pathlib import Path

from benchmarks.comparison.rows import Row, read_rows

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs/results/comparison.md"
BEGIN, END = "<!-- rows: begin -->\n", "<!-- rows: end -->\n"


def main() -> None:
    """Rewrites the table."""
    parser = argparse.ArgumentParser(description=str(__doc__).partition("\n")[0])
    parser.add_argument("rows", type=Path, nargs="+")
    args = parser.parse_args()
    text = PAGE.read_text(encoding="utf-8")
    found = [row for path in args.rows for row in read_rows(path)]
    PAGE.write_text(with_table(text, found), encoding="utf-8")


def with_table(text: str, rows: Iterable[Row]) -> str:
    """Returns the page with the table of `rows` between its marks."""
    before, _, rest = text.partition(BEGIN)
    _, mark, after = rest.partition(END)
    if not mark:
        raise ValueError(f"{PAGE.name} lacks the marks of its table")
    return f"{before}{BEGIN}\n{table(rows)}\n{END}{after}"


def table(rows: Iterable[Row]) -> str:
    """Returns the rows as a table in Markdown, in their order."""
    head = "| peer | quantity | figure | versions | what it is of | command, commit |"
    lines = [head, "|---|---|---|---|---|---|"]
    for row in rows:
        cells = (
            row.peer,
            f"{row.quantity} ({row.job})",
            _figure(row),
            row.version,
            row.note,
            f"`{row.command}`, {row.commit}; seed {row.seed}; {row.device}",
        )
        lines.append("| " + " | ".join(cell.replace("|", "/") for cell in cells) + " |")
    return "\n".join(lines) + "\n"


def _figure(row: Row) -> str:
    if row.value is None:
        return "none"
    said = f"{_short(row.value)} {row.unit}"
    if row.low is None or row.high is None:
        return said
    return f"{said} ({_short(row.low)} to {_short(row.high)})"


def _short(value: float) -> str:
    return f"{value:,.0f}" if abs(value) >= 1000 else f"{value:.3g}"


if __name__ == "__main__":
    main()
