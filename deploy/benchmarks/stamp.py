"""Where, when, and with which state of the code something was measured."""

import os
import platform
import shlex
import subprocess
import time
from pathlib import Path

HERE = Path(__file__).parent


def stamp(command: list[str], seed: int = 0) -> dict:
    """What belongs to a measurement that begins now.

    Args:
        command: the script and its options.
        seed: of its random numbers.
    """
    changed = _git("status", "--porcelain", "--untracked-files=no", "--", "deploy")
    return {
        "command": shlex.join(
            ["python", f"deploy/benchmarks/{command[0]}", *command[1:]]
        ),
        "seed": seed,
        "commit": _git("rev-parse", "--short", "HEAD")
        + (" changed" if changed else ""),
        "date": time.strftime("%Y-%m-%d %H:%M UTC", time.gmtime()),
        "machine": machine(),
        "load": round(os.getloadavg()[0], 1),
    }


def machine() -> str:
    """Processor, cores and Python of this machine."""
    names = (
        line.partition(": ")[2].strip()
        for line in Path("/proc/cpuinfo").read_text().splitlines()
        if line.startswith("model name")
    )
    model = next(names, platform.machine())
    return f"{model}, {os.cpu_count()} cores, Python {platform.python_version()}"


def _git(*words: str) -> str:
    done = subprocess.run(
        ["git", *words], cwd=HERE, capture_output=True, text=True, check=False
    )
    return done.stdout.strip() if done.returncode == 0 else "unknown"


def sentence(measured: dict) -> str:
    """A stamp in words."""
    return (
        f"Measured by `{measured['command']}` (seed {measured['seed']}) on "
        f"{measured['machine']}, {measured['date']}, commit {measured['commit']}; load "
        f"of the machine before: {measured['load']}."
    )
