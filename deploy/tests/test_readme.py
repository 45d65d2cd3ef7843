"""The program with which the README opens runs a committed bundle on plain arrays."""

import subprocess
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]
LINES = 20


def program() -> str:
    text = (ROOT / "deploy" / "README.md").read_text("utf-8")
    block = text.split("```")[1]
    assert block.startswith("python\n")
    return block.removeprefix("python\n")


def test_it_is_short_and_runs():
    assert len(program().splitlines()) <= LINES
    done = subprocess.run(
        [sys.executable, "-c", program()],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    targets = np.array(done.stdout.strip("[] \n").split(), float)
    assert targets.shape == (20,) and np.isfinite(targets).all()
