"""The benchmark runs and its ratios are those of its numbers."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]


@pytest.mark.slow
def test_throughput_is_measured_and_compared(tmp_path):
    out = tmp_path / "out.json"
    words = [
        "--backend",
        "cpu",
        "--against",
        "jax",
        "--num-envs",
        "8",
        "--seconds",
        "0.1",
        "--json",
        str(out),
    ]
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks.speed.throughput", *words],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    found = json.loads(out.read_text(encoding="utf-8"))
    rates = {(r["backend"], r["layer"]): r["steps_per_s"] for r in found["layers"]}
    assert len(rates) == 6 and min(rates.values()) > 0
    for bare in ("bare physics", "bare, moving"):
        ratio = found["ratios"][f"environment / {bare}"]
        assert ratio == rates["cpu", "environment"] / rates["cpu", bare]
    factor = found["ratios"]["environment: cpu / jax"]
    assert factor == rates["cpu", "environment"] / rates["jax", "environment"]
    assert f"environment: cpu / jax: {factor:.3g}" in done.stdout


@pytest.mark.slow
def test_three_parameters_are_found_within_two_percent(tmp_path):
    out = tmp_path / "out.json"
    words = ["--only", "ours", "--seeds", "3", "--json", str(out)]
    program = [sys.executable, "-m", "benchmarks.diagnosis.identify"]
    subprocess.run([*program, *words], cwd=ROOT, check=True)
    rows = json.loads(out.read_text(encoding="utf-8"))["rows"]
    assert len(rows) == 3
    names = ("stiffness", "damping", "armature")
    assert max(row[name] for row in rows for name in names) < 0.02
