"""A whole run as its operator starts it: the command, typed at through a pipe."""

import contextlib
import fcntl
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from pathlib import Path

_SMALL_PIPE = 4096  # the smallest that there is, to be full soon
PROCESSES = ("guard", "policy", "supervisor")


class ConsoleRun:
    """One run of `fingers-deploy run` against a hand that is there already.

    Args:
        bundle: the policy.
        socket: of the hand.
        more: further arguments.
        reads: whether anybody reads what the run says.
        files_bytes: largest file that it may write, as on a full disk; None: any.
    """

    def __init__(
        self,
        bundle: Path,
        socket: str,
        more: Sequence[str] = (),
        reads: bool = True,
        files_bytes: int | None = None,
    ):
        program = [sys.executable, "-m", "fingers_robot", "run", str(bundle)]
        program += ["--driver", "sim", "--socket", socket, "--wiggle", "none", *more]
        if files_bytes is not None:
            program = ["prlimit", f"--fsize={files_bytes}", *program]
        self.process = subprocess.Popen(
            program,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
        self.lines: list[tuple[float, str]] = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        if reads:
            self._reader.start()
        else:
            assert self.process.stdout is not None
            fcntl.fcntl(self.process.stdout, fcntl.F_SETPIPE_SZ, _SMALL_PIPE)

    def type(self, words: str) -> float:
        """Types lines; returns when [s]."""
        assert self.process.stdin is not None
        now = time.monotonic()
        with contextlib.suppress(OSError):
            os.write(self.process.stdin.fileno(), words.encode())
        return now

    def said(self, words: str, after_s: float = 0.0) -> float | None:
        """When a line with these words was read first [s]; None: not yet."""
        at = (t for t, line in list(self.lines) if words in line and t > after_s)
        return next(at, None)

    def wait_for(self, words: str, seconds: float, after_s: float = 0.0) -> float:
        """Waits until a line with these words was read; returns when [s].

        Raises:
            TimeoutError: with all that was read.
        """
        deadline = time.monotonic() + seconds
        while (t := self.said(words, after_s)) is None:
            if time.monotonic() > deadline:
                raise TimeoutError(f"no {words!r} in {self.lines}")
            time.sleep(0.002)
        return t

    def pids(self) -> dict[str, int]:
        """The processes of the run by name; the console is the first."""
        found = {"console": self.process.pid}
        for folder in Path("/proc").glob("[0-9]*"):
            with contextlib.suppress(OSError, ProcessLookupError):
                words = (folder / "cmdline").read_bytes().split(b"\0")
                if os.getpgid(int(folder.name)) != self.process.pid:
                    continue
                for name in PROCESSES:
                    if f"fingers_robot.runtime.{name}_process".encode() in words:
                        found[name] = int(folder.name)
        return found

    def signal(self, number: signal.Signals, *names: str) -> float:
        """Sends a signal to processes of the run, at once; returns when [s]."""
        pids = self.pids()
        now = time.monotonic()
        for name in names:
            os.kill(pids[name], number)
        return now

    def close(self) -> None:
        """Ends what is left of the run."""
        for pid in self.pids().values():
            with contextlib.suppress(OSError):
                os.kill(pid, signal.SIGKILL)
        self.process.wait()
        for pipe in (self.process.stdin, self.process.stdout):
            if pipe is not None and not (pipe.closed or self._reader.is_alive()):
                with contextlib.suppress(OSError):
                    pipe.close()

    def __enter__(self) -> "ConsoleRun":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            now = time.monotonic()
            self.lines.append((now, line.decode("utf-8", "replace").rstrip("\n")))


def energize(run: ConsoleRun, seconds: float = 60.0) -> float:
    """Arms until it is taken; returns when the hand was energized [s]."""
    begun_s = time.monotonic()
    while time.monotonic() < begun_s + seconds:
        asked_s = run.type("arm\n")
        while time.monotonic() - asked_s < 0.6:
            # An answer that came late is one to an earlier word.
            if (at := run.said("disabled -> arming", begun_s)) is not None:
                return at
            if run.said("arm refused", asked_s) is not None:
                break
            time.sleep(0.005)
        time.sleep(0.3)
    raise TimeoutError(f"not armed: {run.lines[-20:]}")
