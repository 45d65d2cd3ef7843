"""One bad input: made, tried in this process, and judged."""

import contextlib
import io
import os
import shutil
import time
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.inputs.damage import HARD, SOFT
from benchmarks.inputs.originals import write_originals
from benchmarks.inputs.targets import BAD, COMMANDS, TOLERANT, WORDS, readers
from envs.errors import InputError
from fingers_mjx.cli.main import main as fingers
from fingers_robot.cli.main import main as fingers_deploy

LONGEST, SLOWEST_S, LARGEST_MB = 300, 5.0, 300.0
_REFUSED, _ACCEPTED = "refused", "accepted"
_BOTH = SOFT | HARD


@dataclass(frozen=True)
class Result:
    """What one input showed.

    Attributes:
        number: of the input.
        name: what was tried.
        verdict: `refused`, `accepted`, or what went wrong.
        seconds: how long it took [s].
        megabytes: memory beyond the start [MB].
    """

    number: int
    name: str
    verdict: str
    seconds: float
    megabytes: float

    @property
    def wrong(self) -> bool:
        """Whether it was not refused as it must be."""
        return self.verdict not in (_REFUSED, _ACCEPTED)


class Trials:
    """Tries inputs by number.

    Args:
        folder: an empty folder, in which everything happens.
        seed: of the inputs.
    """

    def __init__(self, folder: Path, seed: int):
        self._seed = seed
        self._inputs, self._place = folder / "inputs", folder / "here"
        self._originals = write_originals(folder / "originals")
        self._readers = readers()
        self._place.mkdir()
        os.chdir(self._place)
        for name in sorted(COMMANDS):  # what is imported at first is not the input's
            _judge_command(self._filled(COMMANDS[name][1], "nowhere"))

    def run(self, number: int) -> Result:
        """Tries the input of a number."""
        rng = np.random.default_rng((self._seed, number))
        shutil.rmtree(self._inputs, ignore_errors=True)
        self._inputs.mkdir()
        kind = number % 3
        if kind == 0:
            name, call, hard = self._reader(rng)
        elif kind == 1:
            name, call, hard = self._command(rng)
        else:
            name, call, hard = self._words(rng)
        begin, before = time.monotonic(), _reset_peak()
        verdict = call()
        seconds, megabytes = time.monotonic() - begin, _peak_mb() - before
        if verdict == _ACCEPTED and hard:
            verdict = "not refused"
        if verdict in (_REFUSED, _ACCEPTED):
            verdict = self._limits(verdict, seconds, megabytes)
        return Result(number, name, verdict, seconds, megabytes)

    def _reader(self, rng) -> tuple[str, Callable[[], str], bool]:
        name = str(rng.choice(sorted(self._readers)))
        file, read = self._readers[name]
        how, path = self._damaged(file, _BOTH, rng)
        hard = how in HARD and name not in TOLERANT
        return f"reader {name}: {how}", lambda: _judge_reader(read, path), hard

    def _command(self, rng) -> tuple[str, Callable[[], str], bool]:
        name = str(rng.choice(sorted(COMMANDS)))
        file, words = COMMANDS[name]
        how, path = self._damaged(file, HARD, rng)
        filled = self._filled(words, str(path))
        return f"command {name}: {how}", lambda: _judge_command(filled), True

    def _words(self, rng) -> tuple[str, Callable[[], str], bool]:
        head, tail = WORDS[int(rng.integers(len(WORDS)))]
        bad = BAD[tail[0]]
        word = bad[int(rng.integers(len(bad)))]
        filled = [*self._filled(head, ""), word, *tail[1:]]
        name = " ".join(w for w in head if w.isascii() and not w.startswith("/"))
        shown = ascii(word[:30])
        return f"words {name or 'none'}: {shown}", lambda: _judge_command(filled), True

    def _damaged(self, file: str, kinds: dict, rng) -> tuple[str, Path]:
        """Copies a sound file with what stands beside it, and damages it."""
        sound = self._originals[file]
        path = self._inputs / sound.name
        if sound.parent.name in ("run", "bundle"):
            for other in sound.parent.iterdir():
                if other != sound:
                    shutil.copy(other, self._inputs / other.name)
        if file == "config":
            shutil.copy(self._originals["hand"], self._inputs / "hand")
        how = str(rng.choice(sorted(kinds)))
        kinds[how](path, sound.read_bytes(), rng)
        return how, path

    def _filled(self, words: Sequence[str], path: str) -> list[str]:
        out = str(self._place / "out")
        return [w.replace("FILE", path).replace("OUT", out) for w in words]

    def _limits(self, verdict: str, seconds: float, megabytes: float) -> str:
        written = sorted(p.name for p in self._place.rglob("*"))
        if written:
            for path in self._place.iterdir():
                shutil.rmtree(path) if path.is_dir() else path.unlink()
            return f"wrote {written[:5]}"
        if seconds > SLOWEST_S:
            return f"took {seconds:.1f} s"
        if megabytes > LARGEST_MB:
            return f"took {megabytes:.0f} MB"
        return verdict


def _judge_reader(read: Callable[[Path], object], path: Path) -> str:
    """Reads a file that is bad."""
    try:
        read(path)
    except InputError as error:
        return _judge_sentence(str(error))
    except BaseException as error:
        return _place_of(error)
    return _ACCEPTED


def _judge_command(words: Sequence[str]) -> str:
    """Runs a command that must be refused."""
    said, printed = io.StringIO(), io.StringIO()
    deploy = bool(words) and words[0] == "fingers-deploy"
    try:
        with contextlib.redirect_stderr(said), contextlib.redirect_stdout(printed):
            status = fingers_deploy(words[1:]) if deploy else fingers(words)
    except BaseException as error:
        return _place_of(error)
    if status != 2:
        return f"status {status}"
    lines = said.getvalue().splitlines()
    return _judge_sentence(lines[0]) if len(lines) == 1 else f"{len(lines)} lines"


def _judge_sentence(sentence: str) -> str:
    text = sentence.removeprefix("fingers: ").removeprefix("fingers-deploy: ")
    if len(text) > LONGEST:
        return f"{len(text)} characters"
    return _REFUSED if text.isprintable() else "characters that do not print"


def _place_of(error: BaseException) -> str:
    last = traceback.extract_tb(error.__traceback__)[-1]
    return f"{type(error).__name__} in {Path(last.filename).name}:{last.lineno}"


def _reset_peak() -> float:
    """Starts the peak of this process's memory again; memory now [MB]."""
    with contextlib.suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")
    return _status_mb("VmRSS")


def _peak_mb() -> float:
    return _status_mb("VmHWM")


def _status_mb(field: str) -> float:
    lines = Path("/proc/self/status").read_text().splitlines()
    found = next(line for line in lines if line.startswith(f"{field}:"))
    return int(found.split()[1]) / 1e3
