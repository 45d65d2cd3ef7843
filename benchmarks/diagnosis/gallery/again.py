"""The page about the gallery's records, diagnosed again by later code, in Markdown.

python -m benchmarks.diagnosis.gallery.again
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path

from benchmarks.diagnosis.gallery.__main__ import RECORDS
from benchmarks.diagnosis.gallery.overview import (
    OPEN,
    RIGHT,
    WRONG,
    named_effects,
    not_distinguished,
    rating,
)
from benchmarks.diagnosis.gallery.page import read_rows
from benchmarks.diagnosis.gallery.record import Record
from envs.config.atomic_file import write_atomic

FIRST = Path("benchmarks/results/gallery.jsonl")
AGAIN = Path("benchmarks/results/gallery-again.jsonl")
PAGE = Path("docs/results/gallery_again.md")

TEXT = """\
# The gallery again

The diagnosis has changed since the [records of other people's robots](gallery.md) were
looked at. So {number} of the {all} were diagnosed again, by commit {commits}: to see
whether something was lost, not as evidence, since all of them had been seen. The rule
is the same. Seconds are of one core beside other work.

| | {ratings} |
|---|---|---|---|
{counts}

| record | first answer | this answer | seconds |
|---|---|---|---|
{lines}

```sh
python -m benchmarks.diagnosis.gallery --folder clones --fetch --out {again}
python -m benchmarks.diagnosis.gallery.again
```
"""
_HALVES = {"second": "looked at once", "first": "for development"}


def again(
    records: Mapping[str, Record], before: Sequence[dict], now: Sequence[dict]
) -> str:
    """Returns the page in Markdown.

    Args:
        records: by name.
        before: what the diagnosis said first, one of every record.
        now: what it says now, of some or all of them.
    """
    first = {row["record"]: row for row in before}
    order = sorted(now, key=lambda row: (records[row["record"]].half, row["record"]))
    return TEXT.format(
        number=len(now),
        all=len(records),
        commits=" and ".join(sorted({row["commit"] for row in now})),
        ratings=" | ".join((RIGHT, WRONG, OPEN)),
        counts="\n".join(_counts(records, first, now, half) for half in _HALVES),
        lines="\n".join(_line(first[row["record"]], row) for row in reversed(order)),
        again=AGAIN,
    )


def _counts(
    records: Mapping[str, Record], first: Mapping[str, dict], now: Sequence[dict], half
) -> str:
    """How many of a half are right, wrong and open, first and now."""
    rows = [row for row in now if records[row["record"]].half == half]
    said = Counter(map(rating, rows))
    was = Counter(rating(first[row["record"]]) for row in rows)
    cells = [f"{said[kind]} (first {was[kind]})" for kind in (RIGHT, WRONG, OPEN)]
    return f"| {_HALVES[half]} | {' | '.join(cells)} |"


def _line(before: dict, now: dict) -> str:
    name = now["record"]
    answers = [f"{rating(row)}: {_said(row)}" for row in (before, now)]
    cells = (f"[`{name}`](gallery/{name}.md)", *answers, f"{now['runtime_s']:.0f}")
    return f"| {' | '.join(cells)} |"


def _said(row: dict) -> str:
    """Verdict, causes with their joints, and what is not distinguished from them."""
    named = named_effects(row["causes"], sizes=False)
    causes = "; ".join([*named, *not_distinguished(row["alike"])])
    return f"`{row['verdict']}` {causes}".strip()


def main() -> None:
    """Runs from the command line."""
    text = again(RECORDS, read_rows(FIRST), read_rows(AGAIN))
    write_atomic(PAGE, text.encode())
    print(PAGE)


if __name__ == "__main__":
    main()
