"""What somebody waits for who has just cloned the repository, step by step.

    python -m benchmarks.speed.first_half_hour --out half-hour
    python -m benchmarks.speed.first_half_hour --out half-hour --steps clone install

Clones this repository into a new folder and types there what the README says: install,
a picture of the hand, the viewer until its page is served, training until the first
row of its curve, and the demonstration to its report. The cache of compiled programs is
a new one; the packages are those that uv has already, so the network does not count.
Prints a row after each step, in Markdown: its seconds, those since the clone began, and
the load of the machine when it ended.
"""

import argparse
import os
import platform
import socket
import subprocess
import time
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

ROOT = Path(__file__).parents[2]
LIMIT_S = 3600.0
POLL_S = 0.1
STDERR = 2
FINGERS = ".venv/bin/fingers"
COPY, SINGLE = "copy", "runs/first"


def main() -> None:
    """Takes the steps one after the other and prints the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True, help="a new folder")
    parser.add_argument("--steps", nargs="+", choices=STEPS, default=list(STEPS))
    args = parser.parse_args()
    if args.out.exists():
        parser.error(f"--out: found {args.out}, which is there; valid: a new folder")
    args.out.mkdir(parents=True)
    copy = args.out.absolute() / COPY
    print(f"commit {_commit()}, {os.cpu_count()} cores ({platform.machine()})\n")
    print(
        "| until | command | seconds | since the clone | load |\n|---|---|---|---|---|"
    )
    began = time.monotonic()
    for name in args.steps:
        what, command, step = STEPS[name]
        start = time.monotonic()
        step(copy)
        end = time.monotonic()
        times = f"{end - start:.0f} | {end - began:.0f}"
        load = f"{os.getloadavg()[0]:.1f}"
        print(f"| {what} | `{command}` | {times} | {load} |", flush=True)


def clone(copy: Path) -> None:
    """Clones the repository as it is committed."""
    _run(["git", "clone", "--quiet", str(ROOT), str(copy)], copy.parent)


def install(copy: Path) -> None:
    """Installs the locked packages."""
    _run(["make", "sync"], copy)


def picture(copy: Path) -> None:
    """Draws the hand in its stance."""
    _run([FINGERS, "hand", "show", "--out", "hand"], copy)


def viewer(copy: Path) -> None:
    """Waits until the page of the viewer is served."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    page = f"http://127.0.0.1:{port}"

    def served() -> bool:
        try:
            with urllib.request.urlopen(page, timeout=5) as answer:
                return answer.status == 200
        except (urllib.error.URLError, OSError):
            return False

    with _running([FINGERS, "play", "--viewer", "--port", str(port)], copy) as process:
        _wait(process, served)


def number(copy: Path) -> None:
    """Waits for the first row of a curve."""
    curve = copy / SINGLE / "metrics.jsonl"
    command = [FINGERS, "train", "crawl", "--preset", "cpu", "--out", SINGLE]
    with _running(command, copy) as process:
        _wait(process, lambda: curve.exists() and curve.stat().st_size > 0)


def demo(copy: Path) -> None:
    """Runs the demonstration to its report."""
    _run(["make", "demo"], copy)
    if not (copy / "demo/report.html").exists():
        raise SystemExit("make demo: found no demo/report.html")


STEPS: dict[str, tuple[str, str, Callable[[Path], None]]] = {
    "clone": ("a copy of the repository", "git clone", clone),
    "install": ("everything installed", "make sync", install),
    "picture": ("a picture of the hand", "fingers hand show --out hand", picture),
    "viewer": ("the viewer's page", "fingers play --viewer", viewer),
    "number": ("the first training number", "fingers train crawl --preset cpu", number),
    "demo": ("the report of the demo", "make demo", demo),
}


def _run(command: list[str], folder: Path) -> None:
    """Runs a command to its end; what it says goes to the standard error."""
    subprocess.run(
        command,
        cwd=folder,
        env=_environment(folder),
        stdout=STDERR,
        check=True,
        timeout=LIMIT_S,
    )


@contextmanager
def _running(command: list[str], folder: Path) -> Iterator[subprocess.Popen[bytes]]:
    """Starts a command, and ends it at once: how it would stop does not count."""
    process = subprocess.Popen(
        command, cwd=folder, env=_environment(folder), stdout=STDERR
    )
    try:
        yield process
    finally:
        process.kill()
        process.wait()


def _wait(process: subprocess.Popen[bytes], done: Callable[[], bool]) -> None:
    """Waits until something is there, as long as the process lives."""
    end = time.monotonic() + LIMIT_S
    while not done():
        if process.poll() is not None or time.monotonic() > end:
            raise SystemExit(f"the command ended too early: {process.args}")
        time.sleep(POLL_S)


def _environment(folder: Path) -> dict[str, str]:
    """Returns the environment of a newcomer: no active one, nothing compiled."""
    kept = {k: v for k, v in os.environ.items() if k != "VIRTUAL_ENV"}
    return kept | {"FINGERS_COMPILE_CACHE": str(folder.parent / "compiled")}


def _commit() -> str:
    command = ["git", "-C", str(ROOT), "rev-parse", "--short", "HEAD"]
    return subprocess.run(
        command, capture_output=True, text=True, check=True
    ).stdout.strip()


if __name__ == "__main__":
    main()
