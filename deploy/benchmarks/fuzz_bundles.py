"""Damaged bundles: every one must be refused with one sentence.

    python deploy/benchmarks/fuzz_bundles.py --count 10000

As a control, ONNX Runtime alone is given 1,000 policies with one bit flipped.
"""

import argparse
import contextlib
import io
import json
import sys
import tempfile
from pathlib import Path

import numpy as np
from hand_files import WALKING

from fingers_deploy.bundle import Bundle, load_bundle
from fingers_deploy.policy import OnnxPolicy
from fingers_mjx.export.bundle import write_bundle
from fingers_robot.cli.main import main as command

CONTROL = 1000
KINDS = ("bit flip", "byte", "truncation", "insertion", "swap", "manifest edit")


def damage(policy: bytes, manifest: bytes, kind: str, rng) -> tuple[bytes, bytes]:
    """Damages one of the two files."""
    if kind == "manifest edit":
        return policy, _edit_manifest(manifest, rng)
    data = bytearray(policy)
    place = int(rng.integers(len(data)))
    if kind == "bit flip":
        data[place] ^= 1 << int(rng.integers(8))
    elif kind == "byte":
        data[place] = (data[place] + int(rng.integers(1, 256))) % 256
    elif kind == "truncation":
        del data[place:]
    elif kind == "insertion":
        data[place:place] = rng.bytes(int(rng.integers(1, 64)))
    else:
        other = int(rng.integers(len(data)))
        while data[other] == data[place]:
            other = int(rng.integers(len(data)))
        data[place], data[other] = data[other], data[place]
    return bytes(data), manifest


def _edit_manifest(manifest: bytes, rng) -> bytes:
    """Changes a number or a key, so that the JSON often stays well-formed."""
    table = json.loads(manifest)
    interface = table["interface"]
    edits = (
        lambda: interface["action"].update(scale_rad=float(rng.uniform(0.01, 1.0))),
        lambda: interface["joint_names"].reverse(),
        lambda: interface["reference_angles_rad"].reverse(),
        lambda: interface.update(control_rate_hz=float(rng.integers(10, 1000))),
        lambda: interface.pop(str(rng.choice(sorted(interface)))),
        lambda: table.update({str(rng.integers(1000)): 1}),
        lambda: table["policy"].update(sha256="0" * 64),
    )
    edits[int(rng.integers(len(edits)))]()
    return json.dumps(table).encode()


def loaded_unchecked(bundle: Bundle, count: int, seed: int) -> int:
    """How many of `count` policies with one flipped bit ONNX Runtime alone loads."""
    rng = np.random.default_rng(seed)
    loaded = 0
    for _ in range(count):
        data, _ = damage(bundle.model, b"", "bit flip", rng)
        with contextlib.suppress(Exception):  # whatever it raises, it did not load
            OnnxPolicy(data)
            loaded += 1
    return loaded


def measure(bundle: Bundle, count: int, seed: int) -> dict:
    """Damages `count` bundles; returns how many of each kind were not refused."""
    rng = np.random.default_rng(seed)
    accepted = dict.fromkeys(KINDS, 0)
    wordy = 0
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "bundle"
        write_bundle(path, bundle)
        files = path / "policy.onnx", path / "manifest.json"
        sound = [file.read_bytes() for file in files]
        for number in range(count):
            kind = KINDS[number % len(KINDS)]
            for file, data in zip(files, damage(*sound, kind, rng), strict=True):
                file.write_bytes(data)
            said = io.StringIO()
            with contextlib.redirect_stderr(said), contextlib.redirect_stdout(said):
                # A driver that is not there: nothing may be opened before the refusal.
                status = command(
                    ["run", str(path), "--driver", "sim", "--socket", "/nonexistent"]
                )
            accepted[kind] += status != 2
            wordy += len(said.getvalue().splitlines()) != 1
    return {
        "seed": seed,
        "damaged": count,
        "accepted": sum(accepted.values()),
        "by_kind": accepted,
        "not_one_line": wordy,
    }


def main() -> int:
    """Runs the measurement; returns 0 if every bundle was refused."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bundle", type=Path, default=WALKING)
    parser.add_argument("--count", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    bundle = load_bundle(options.bundle)
    result = measure(bundle, options.count, options.seed)
    result["control"] = min(options.count, CONTROL)
    result["control_loaded"] = loaded_unchecked(bundle, result["control"], options.seed)
    print(json.dumps(result))
    return int(result["accepted"] + result["not_one_line"] > 0)


if __name__ == "__main__":
    sys.exit(main())
