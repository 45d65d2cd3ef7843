"""Writes the pages of the gallery from what the diagnosis said.

python -m benchmarks.diagnosis.gallery.page benchmarks/results/gallery.jsonl
"""

import argparse
import json
from pathlib import Path

from benchmarks.diagnosis.gallery.__main__ import RECORDS
from benchmarks.diagnosis.gallery.overview import overview
from benchmarks.diagnosis.gallery.record import Record
from envs.config.atomic_file import write_atomic

FOLDER, PAGE = Path("docs/results/gallery"), Path("docs/results/gallery.md")
_LEAST = 0.05
"""Probability below which a hypothesis is not on a page."""


def page(record: Record, row: dict) -> str:
    """Returns the page of one record in Markdown."""
    where = f"https://github.com/{record.repository}"
    lines = [
        f"# {record.name}",
        "",
        f"{record.robot[0].upper()}{record.robot[1:]}.",
        "",
        "| | |",
        "|---|---|",
        f"| data | [{record.repository}]({where}), commit {record.commit}, licence: "
        f"{record.licence} |",
        f"| the authors say | {record.documented} |",
        f"| where | {record.where} |",
        f"| right would be | {', '.join(record.effects)} |",
        f"| verdict | **{row['verdict']}**, {row['runtime_s']:.0f} s, "
        f"commit {row['commit']} |",
        f"| documented cause in the named set | {'yes' if row['right'] else 'no'} |",
        "",
        row["summary"],
        "",
        *_causes(row),
        *_probable(row),
        record.remark,
        "",
        "```sh",
        "python -m benchmarks.diagnosis.gallery --folder clones --fetch "
        f"--only {record.name}",
        "```",
    ]
    return "\n".join(lines) + "\n"


def _causes(row: dict) -> list[str]:
    """Table of the causes with their 95 % intervals."""
    if not row["causes"]:
        return []
    lines = ["| cause | joint | size, 95 % interval | gain |", "|---|---|---|---|"]
    for cause in row["causes"]:
        sizes = "; ".join(
            f"{name} {e['value']:.3g} ({e['low']:.3g} to {e['high']:.3g}) {e['unit']}"
            for name, e in cause["parameters"].items()
        )
        gain = f"{cause['evidence']:.0f} nat"
        lines.append(f"| {cause['effect']} | {cause['where']} | {sizes} | {gain} |")
    return [*lines, ""]


def _probable(row: dict) -> list[str]:
    """What is probable, joint by joint."""
    said = [
        f"{h['joint']}: {_named(h['effects'])} {h['probability']:.0%}"
        for h in row["posterior"]
        if h["probability"] >= _LEAST
    ]
    return [f"Probabilities: {'; '.join(said)}.", ""] if said else []


def _named(effects: list[str] | None) -> str:
    if effects is None:
        return "none of these"
    return " and ".join(effects) or "no effect"


def main() -> int:
    """Writes a page for every row, and the one that gathers them if all are there."""
    parser = argparse.ArgumentParser(description="Write the pages of the gallery.")
    parser.add_argument("rows", type=Path)
    rows = read_rows(parser.parse_args().rows)
    FOLDER.mkdir(parents=True, exist_ok=True)
    for row in rows:
        record = RECORDS[row["record"]]
        write_atomic(FOLDER / f"{record.name}.md", page(record, row))
    if len(rows) < len(RECORDS):
        print(f"{PAGE} is left as it was: {len(rows)} of {len(RECORDS)} records")
    else:
        write_atomic(PAGE, overview(RECORDS, rows))
    return 0


def read_rows(path: Path) -> list[dict]:
    """Returns what the diagnosis said, a row for each record.

    Args:
        path: that `python -m benchmarks.diagnosis.gallery` wrote.
    """
    return [json.loads(row) for row in path.read_text(encoding="utf-8").splitlines()]


if __name__ == "__main__":
    raise SystemExit(main())
