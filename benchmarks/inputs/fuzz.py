"""Bad inputs for every reader and every command: how each is refused.

    python -m benchmarks.inputs.fuzz --count 5000

An input must be refused by one sentence of at most 300 characters and exit status 2,
within 5 s and 300 MB, and nothing may be written. Damage after which a file is sound
by chance counts as accepted; after hostile damage none is. The same seed and count give
the same inputs.
"""

import argparse
import json
import multiprocessing
import sys
import tempfile
from collections import Counter
from multiprocessing.connection import Connection
from pathlib import Path

from benchmarks.inputs.trial import Result, Trials

_PATIENCE_S = 90.0
_SHOWN = 20


def serve(folder: str, seed: int, link: Connection) -> None:
    """Tries the inputs whose numbers come, until the other end closes."""
    trials = Trials(Path(folder), seed)
    link.send(None)
    while True:
        try:
            number = link.recv()
        except EOFError:
            return
        link.send(trials.run(number))


class Worker:
    """A process in which inputs are tried; it is replaced when one hangs or kills it.

    Args:
        seed: of the inputs.
    """

    def __init__(self, seed: int):
        self._seed = seed
        self._start()

    def run(self, number: int) -> Result:
        """Tries one input."""
        self._link.send(number)
        try:
            if self._link.poll(_PATIENCE_S):
                return self._link.recv()
            what = "hangs"
        except EOFError:
            what = "dies"
        self.close()
        self._start()
        return Result(number, "?", what, _PATIENCE_S, 0.0)

    def close(self) -> None:
        """Ends the process."""
        self._link.close()
        self._process.kill()
        self._process.join()
        self._folder.cleanup()

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._folder = tempfile.TemporaryDirectory(prefix="inputs-")
        self._link, other = context.Pipe()
        arguments = (self._folder.name, self._seed, other)
        self._process = context.Process(target=serve, args=arguments, daemon=True)
        self._process.start()
        other.close()
        self._link.recv()


def measure(count: int, seed: int, first: int = 0) -> list[Result]:
    """Tries `count` inputs from a number on."""
    worker = Worker(seed)
    try:
        return [worker.run(number) for number in range(first, first + count)]
    finally:
        worker.close()


def report(results: list[Result], seed: int) -> dict:
    """What all trials showed together."""
    verdicts = Counter(r.verdict for r in results)
    wrong = [r for r in results if r.wrong]
    return {
        "inputs": len(results),
        "seed": seed,
        "refused": verdicts["refused"],
        "sound by chance": verdicts["accepted"],
        "wrong": len(wrong),
        "slowest_s": round(max(r.seconds for r in results), 2),
        "largest_mb": round(max(r.megabytes for r in results)),
        "targets": len({r.name.split(":")[0] for r in results}),
    }


def main() -> int:
    """Runs the measurement; returns 0 if every input was refused as it must be."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--count", type=int, default=5000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--first", type=int, default=0, help="number of the first")
    options = parser.parse_args()
    worker, results = Worker(options.seed), []
    for number in range(options.first, options.first + options.count):
        result = worker.run(number)
        results.append(result)
        if result.wrong:
            print(f"{number}: {result.name}: {result.verdict}", flush=True)
        if len(results) % 500 == 0:
            print(json.dumps(report(results, options.seed)), file=sys.stderr)
    worker.close()
    print(json.dumps(report(results, options.seed)))
    return int(any(result.wrong for result in results))


if __name__ == "__main__":
    sys.exit(main())
