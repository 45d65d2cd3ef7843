"""Runs the diagnosis on public records and keeps what it says.

python -m benchmarks.diagnosis.gallery --folder clones --fetch --out gallery.jsonl
"""

import argparse
import dataclasses
import json
import subprocess
import sys
from pathlib import Path

from benchmarks.diagnosis.gallery.record import Record
from benchmarks.diagnosis.gallery.records import (
    airbot,
    amd02,
    cloud_pendulum,
    dfki_double_pendulum,
    dfki_pendulum,
    franka,
    kr300,
    miuzei,
    rokae,
    sts3250,
    tx40,
    ur10e,
)
from envs.config.atomic_file import write_atomic
from envs.errors import InputError, one_of
from fingers_mjx.reports.page import commit_here
from sysid.diagnosis.diagnose import diagnose
from sysid.diagnosis.whole_loops import compile_loops_whole
from sysid.result import Diagnosis

RECORDS = {
    module.RECORD.name: module.RECORD
    for module in (
        *(amd02, dfki_pendulum, miuzei, rokae, sts3250, ur10e),
        *(airbot, cloud_pendulum, dfki_double_pendulum, franka, kr300, tx40),
    )
}


def answer(record: Record, said: Diagnosis) -> dict:
    """Compares a diagnosis with what the authors say.

    The named set are the causes and what these records do not distinguish from them;
    `right` says whether a documented effect is in it.
    """
    alike = [a for a in said.alternatives if not a.distinguishable]
    named = {c.effect for c in said.causes} | {a.effect for a in alike}
    return {
        "record": record.name,
        "verdict": said.verdict,
        "causes": [dataclasses.asdict(cause) for cause in said.causes],
        "alike": [a.effect for a in alike],
        "first": bool(said.causes) and said.causes[0].effect in record.effects,
        "right": bool(named & set(record.effects)),
        "summary": said.summary,
        "posterior": [dataclasses.asdict(h) for h in said.posterior],
        "runtime_s": said.runtime_s,
        "commit": commit_here(),
    }


def main() -> int:
    """Diagnoses the records that are asked for."""
    compile_loops_whole()  # as the command does
    parser = argparse.ArgumentParser(description="Diagnose public records.")
    parser.add_argument("--folder", type=Path, required=True, help="of the clones")
    parser.add_argument("--fetch", action="store_true", help="clone what is missing")
    parser.add_argument("--only", nargs="+", default=list(RECORDS), metavar="NAME")
    parser.add_argument("--out", type=Path, default=Path("gallery.jsonl"))
    args = parser.parse_args()
    rows = []
    try:
        for name in args.only:
            if name not in RECORDS:
                raise InputError("--only", "", name, one_of(RECORDS, name))
            record = RECORDS[name]
            if args.fetch:
                record.fetch(args.folder)
            said = diagnose(*record.made(record.reader(args.folder)))
            rows.append(answer(record, said))
            write_atomic(args.out, "".join(json.dumps(row) + "\n" for row in rows))
            causes = ", ".join(f"{c.effect} ({c.where})" for c in said.causes)
            print(
                f"{name}: {said.verdict} {causes}; {said.runtime_s:.0f} s", flush=True
            )
    except (InputError, subprocess.CalledProcessError) as error:
        print(error, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
