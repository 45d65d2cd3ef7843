"""How a worker speaks to the command that started it; the standard library alone.

A worker prints lines that begin with `MARK` and hold JSON. All other output is the
peer's own and is kept for error messages.
"""

import argparse
import json
import sys
import time
from collections.abc import Callable
from pathlib import Path

MARK = "@row "
STEPS_PER_CALL = {"cpu": 4, "gpu": 50}
"""Control steps of all worlds in one timed call, by device; few where MJX is slow."""

STANDING_STEPS = 500
"""Control steps that ended episodes last on average where hands stand: 10 s."""

DIFFERENCE = "largest difference of a policy's weight, resumed training against whole"
EXPORT = "largest difference of an action, exported ONNX against training"


def largest(one, other) -> float:
    """Returns the largest absolute difference between two lists of arrays."""
    return max(float(abs(a - b).max()) for a, b in zip(one, other, strict=True))


def arguments() -> argparse.Namespace:
    """Parses what every worker is given."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--worlds", type=int, default=64)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--device", choices=("cpu", "gpu"), default="cpu")
    parser.add_argument("--backend", default="", help="physics; empty for the default")
    parser.add_argument("--mjcf", type=Path, help="the standing hand")
    parser.add_argument("--out", type=Path, help="folder for what must be written")
    parser.add_argument(
        "--seconds", type=float, default=480.0, help="of a training of given length"
    )
    return parser.parse_args()


def say(**fields) -> None:
    """Sends one message to the command."""
    print(MARK + json.dumps(fields), flush=True)


def serve(call: Callable[[], int], **about) -> None:
    """Times `call` whenever the command asks, so that workers can take turns.

    Args:
        call: does control steps in all worlds, waits for them, returns their number.
        about: what the command writes into the row: version, note.
    """
    call()
    say(ready=True, **about)
    for line in sys.stdin:
        if line.strip() != "go":
            return
        start = time.perf_counter()
        steps = call()
        say(rate=steps / (time.perf_counter() - start))
