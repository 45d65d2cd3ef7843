"""What loggers have written, read back by means other than ours."""

import json
import re
import struct
import subprocess
import sys
import time
from pathlib import Path

BLOCK, HEADER = 32768, 7
CELL = re.compile(r"┆\s+(\d+)\s+┆[^┆]+┆[^┆]+┆\s+\[([^\]]+)\]")


def wandb_records(path):
    """Yields the records of a `.wandb` file, which is a LevelDB log."""
    from wandb.proto.wandb_internal_pb2 import Record

    content = path.read_bytes()
    at, whole = HEADER, b""
    while at + HEADER <= len(content):
        left = BLOCK - at % BLOCK
        if left < HEADER:
            at += left
            continue
        _, length, kind = struct.unpack("<IHB", content[at : at + HEADER])
        whole += content[at + HEADER : at + HEADER + length]
        at += HEADER + length
        if kind in (1, 4):  # the whole of a record, or its last part
            yield Record.FromString(whole)
            whole = b""


def whole_records(path, limit_s=20.0):
    """The records once the last is there: wandb's process writes on for a moment."""
    end = time.monotonic() + limit_s
    while True:
        records = list(wandb_records(path))
        if any(r.HasField("exit") for r in records) or time.monotonic() > end:
            return records
        time.sleep(0.05)


def wandb_runs(run_dir):
    """Returns (run, rows) for each time that the run was opened, oldest first."""
    found = []
    for path in sorted(run_dir.glob("wandb/offline-run-*/run-*.wandb")):
        records = whole_records(path)
        run = next(r.run for r in records if r.HasField("run"))
        rows = [
            {
                "/".join(i.nested_key) or i.key: json.loads(i.value_json)
                for i in r.history.item
            }
            for r in records
            if r.HasField("history")
        ]
        found.append((run, rows))
    return found


def rerun_chunks(file, home):
    """Returns the chunks of a recording as text by entity, as Rerun itself reads it."""
    tool = Path(sys.executable).with_name("rerun")
    done = subprocess.run(
        [tool, "rrd", "print", "-vvv", file],
        capture_output=True,
        text=True,
        check=True,
        env={"HOME": str(home), "PATH": ""},
    )
    chunks: dict[str, str] = {}
    for chunk in done.stdout.split("\nChunk(")[1:]:
        (entity,) = re.findall(r"entity_path: (\S+)", chunk)
        chunks[entity] = chunks.get(entity, "") + chunk
    return chunks


def rerun_values(chunk):
    """Returns the numbers of an entity by iteration."""
    return {int(at): float(value) for at, value in CELL.findall(chunk)}
