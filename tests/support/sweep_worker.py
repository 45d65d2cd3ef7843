"""A worker that only pretends to train, with faults: python … ROOT NAME SEED [NAME …].

The file `planned(ROOT)` says what goes wrong in which attempt, {"lift/1": ["killed"]};
after the list, all goes well. ROOT/journal.txt gets a line when one begins or ends.
Like the true worker it ends when its standard input is closed.
"""

import json
import os
import signal
import sys
import threading
import time
from pathlib import Path

FINE = ""
STAGE = "train"


def end_with_parent():
    while os.read(0, 1):
        pass
    os._exit(1)


def planned(root):
    return root.with_name(f"{root.name}.faults.json")


def fault(root, member):
    """Returns what goes wrong in this attempt, and counts it."""
    count = root / "runs" / member / "attempts.txt"
    count.parent.mkdir(parents=True, exist_ok=True)
    attempt = len(count.read_text("utf-8")) if count.exists() else 0
    count.write_text("x" * (attempt + 1), "utf-8")
    path = planned(root)
    known = json.loads(path.read_text("utf-8")) if path.exists() else {}
    wrong = known.get(member, [])
    return wrong[attempt] if attempt < len(wrong) else FINE


def note(root, member, status, reason):
    text = json.dumps({"status": status, "reason": reason})
    (root / "runs" / member / "outcome.json").write_text(text, "utf-8")
    print(reason, flush=True)
    return status


def journal(root, word, member):
    line = f"{word} {member} {os.getpid()}\n".encode()
    handle = os.open(root / "journal.txt", os.O_WRONLY | os.O_APPEND | os.O_CREAT)
    os.write(handle, line)
    os.close(handle)


def curve(run, iterations):
    run.mkdir(parents=True, exist_ok=True)
    rows = [{"iteration": n + 1, "iterations": 3} for n in range(iterations)]
    text = "".join(json.dumps(row) + "\n" for row in rows)
    (run / "metrics.jsonl").write_text(text, "utf-8")


def finish(run, name, seed):
    (run / "eval").mkdir(exist_ok=True)
    mean = {"plain": 0.1, "lift": 0.2}.get(name, 0.0) + 0.01 * int(seed)
    summary = {"measures": {"task_speed_mps": {"mean": mean}}}
    part = run / "eval" / "part.json"
    part.write_text(json.dumps(summary), "utf-8")
    part.rename(run / "eval" / "summary.json")


def train(root, name, seed):
    member = f"{name}/{seed}"
    run, wrong = root / "runs" / member / STAGE, fault(root, member)
    (run.parent / "outcome.json").unlink(missing_ok=True)
    if (run / "diverged.json").exists():  # begun again, as on a GPU
        run.rename(run.with_name(f"{STAGE}~diverged"))
    curve(run, 2)
    match wrong:
        case "nan":
            (run / "diverged.json").write_text("{}", "utf-8")
            return note(root, member, 3, "diverged at iteration 2: loss is not finite")
        case "exception":
            return note(root, member, 1, "ValueError: no such thing")
        case "memory":
            words = "XlaRuntimeError: RESOURCE_EXHAUSTED: Out of memory"
            return note(root, member, 1, words)
        case "input":
            return note(root, member, 2, "env.x: found 1; valid: 2")
        case "full":
            return note(root, member, 4, "no room for x: needs 2 bytes, 1 free")
        case "killed":
            print("amid iteration 3", flush=True)
            os.kill(os.getpid(), signal.SIGKILL)
        case "hang":
            print(f"no progress for 300 s; stacks in {run}/hang.txt", flush=True)
            return 75
        case "slow":
            time.sleep(60.0)
    curve(run, 3)
    finish(run, name, seed)
    return 0


if __name__ == "__main__":
    threading.Thread(target=end_with_parent, daemon=True).start()
    root, words = Path(sys.argv[1]), sys.argv[2:]
    members = list(zip(words[::2], words[1::2], strict=True))
    for name, seed in members:
        journal(root, "begin", f"{name}/{seed}")
    statuses = []
    for name, seed in members:
        statuses.append(train(root, name, seed))
        journal(root, "end", f"{name}/{seed}")
    sys.exit(max(statuses))
