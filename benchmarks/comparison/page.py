"""The tables of the page `docs/results/comparison.md`, made from the committed rows.

    python -m benchmarks.comparison.page

Rewrites what stands between the marks of the page and nothing else: one part for each
kind of device. Rates over several numbers of worlds have a table of their own first.
"""

from collections.abc import Iterable, Mapping
from pathlib import Path

from benchmarks.comparison.rows import Row, read_rows

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs/results/comparison.md"
DEVICES = ("cpu", "gpu")
RATES = "speed-"
"""How the names of the jobs begin whose rates are set side by side."""
STARTS = "seconds from the start of the process"
"""How the quantities begin of which each start gives one figure."""
NO_ROWS = "Nothing was measured yet."


def main() -> None:
    """Rewrites the tables."""
    text = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(with_tables(text, committed()), encoding="utf-8")


def committed() -> dict[str, list[Row]]:
    """Returns the committed rows by kind of device; none where there is no file."""
    results = ROOT / "benchmarks/results"
    return {name: read_rows(results / f"comparison-{name}.jsonl") for name in DEVICES}


def with_tables(text: str, rows: Mapping[str, list[Row]]) -> str:
    """Returns the page with the tables of `rows` between the marks of their device."""
    for device, found in rows.items():
        begin, end = (f"<!-- {device} rows: {word} -->\n" for word in ("begin", "end"))
        before, _, rest = text.partition(begin)
        _, mark, after = rest.partition(end)
        if not mark:
            raise ValueError(f"{PAGE.name} lacks the marks of the table {device}")
        text = f"{before}{begin}\n{part(found)}\n{end}{after}"
    return text


def part(rows: list[Row]) -> str:
    """Returns what stands between two marks."""
    if not rows:
        return f"{NO_ROWS}\n"
    return "\n".join(text for text in (rates(rows), table(rows)) if text)


def rates(rows: Iterable[Row]) -> str:
    """Returns control steps per second, peers by worlds; empty for one number of them.

    A rate that could not be taken is a dash; the long table has the reason.
    """
    found = {
        (row.peer, int(row.job.removeprefix(RATES))): row.value
        for row in rows
        if row.job.startswith(RATES) and row.unit == "steps/s"
    }
    sizes = sorted({worlds for _, worlds in found})
    if len(sizes) < 2:
        return ""
    lines = _head("control steps per second", *(f"{n:,} worlds" for n in sizes))
    for peer in dict.fromkeys(peer for peer, _ in found):
        values = [found.get((peer, worlds)) for worlds in sizes]
        lines.append(_line(peer, *("–" if x is None else _short(x) for x in values)))
    return "\n".join(lines) + "\n"


def table(rows: Iterable[Row]) -> str:
    """Returns the rows as a table in Markdown, in their order."""
    what = ("quantity", "figure", "versions", "what it is of", "command, commit")
    lines = _head("peer", *what)
    for row in rows:
        line = _line(
            row.peer,
            f"{row.quantity} ({row.job})",
            _figure(row),
            row.version,
            row.note,
            f"`{row.command}`, {row.commit}; seed {row.seed}; {row.device}",
        )
        lines.append(line)
    return "\n".join(lines) + "\n"


def _head(*cells: str) -> list[str]:
    return [_line(*cells), "|" + "---|" * len(cells)]


def _line(*cells: str) -> str:
    return "| " + " | ".join(cell.replace("|", "/") for cell in cells) + " |"


def _figure(row: Row) -> str:
    if row.value is None:
        return "none"
    said = f"{_short(row.value)} {row.unit}".removesuffix(" 1")
    if row.low is None or row.high is None:
        return said
    if row.low == row.high:  # one figure alone, which has no interval
        return f"{said} (one start)" if row.quantity.startswith(STARTS) else said
    return f"{said} ({_short(row.low)} to {_short(row.high)})"


def _short(value: float) -> str:
    return f"{value:,.0f}" if abs(value) >= 1000 else f"{value:.3g}"


if __name__ == "__main__":
    main()
