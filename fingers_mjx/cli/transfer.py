"""`fingers sysid transfer`: what a found effect is worth on the real hand."""

import argparse
import dataclasses
import json
import sys
from pathlib import Path
from typing import Any

from envs.config.atomic_file import write_atomic
from envs.errors import InputError
from envs.hand.hand_file import load_hand_file
from envs.physics import default_backend
from fingers_mjx.cli.paths import check_directory
from fingers_mjx.cli.train import check_backend
from fingers_mjx.policy.source import PolicySource, load_source
from fingers_mjx.ppo.config import preset
from fingers_mjx.runs.setup import Setup, new_setup, overridden
from fingers_mjx.training.progress import reporter
from fingers_mjx.transfer import compared, in_real_hand, train_on

NAMES: tuple[str, str] = ("default", "extended")


_NOTE = (
    "gain of drift_deg_s and sideways_mps: change of their size; intervals are over "
    "worlds, for this pair of trainings"
)


def run(args: argparse.Namespace) -> int:
    """Trains both policies, unless they are given, and compares them."""
    backend = check_backend(args.backend or default_backend())
    check_directory("--out", args.out)
    if (args.policies is None) == (args.extended is None):
        found = "both" if args.policies else "neither"
        valid = "hands to train on (--extended) or trained policies (--policies)"
        raise InputError("transfer", "", found, valid)
    real = load_hand_file(args.real)
    paths = args.policies or _trained(args, backend)
    loaded = map(load_source, paths)
    sources: dict[str, PolicySource] = dict(zip(NAMES, loaded, strict=True))
    _check_alike(sources)
    found = {}
    for name, source in sources.items():
        print(f"{name} policy in the real hand", file=sys.stderr)
        found[name] = in_real_hand(
            source, real, args.episodes, args.seed, backend, args.steps
        )
    conditions = {
        "backend": backend,
        "episodes": args.episodes,
        "steps": args.steps,
        "real_sha256": real.sha256,
    }
    document = compared(sources, found, args.seed, conditions)
    args.out.mkdir(parents=True, exist_ok=True)
    text = json.dumps(document, indent=2, allow_nan=False)
    write_atomic(args.out / "transfer.json", text)
    print("\n".join(_lines(document)))
    return 0


def _trained(args: argparse.Namespace, backend: str) -> list[Path]:
    """Trains both, with the same settings and the same seed."""
    setup = _setup(args, backend)
    hands = {"default": setup.hand, "extended": load_hand_file(args.extended)}
    if hands["default"].sha256 == hands["extended"].sha256:
        valid = "another hand than the default one"
        raise InputError("--extended", "", "the same hand", valid)
    paths = [args.out / name for name in hands]
    with reporter(sys.stdout) as show:
        for path, (name, hand) in zip(paths, hands.items(), strict=True):
            show({"event": "note", "text": f"training on the {name} hand"})
            train_on(setup, hand, path, args.warm_start, show)
    return paths


def _setup(args: argparse.Namespace, backend: str) -> Setup:
    """Settings of both trainings."""
    name = args.preset or ("fast" if backend == "warp" else "cpu")
    given: dict[str, Any] = {"backend": backend, "seed": args.seed}
    train = dataclasses.replace(preset(name, args.task), **given)
    return overridden(new_setup(train, args.default), args.settings)


def _check_alike(sources: dict[str, PolicySource]) -> None:
    """Refuses to compare policies of different tasks or with different budgets."""
    first, second = sources.values()
    for what, a, b in (
        ("task", first.setup.train.task, second.setup.train.task),
        ("steps of training", first.steps_trained, second.steps_trained),
    ):
        if a != b:
            raise InputError(second.path, what, b, f"{a}, as the first policy")


def _lines(document: dict[str, Any]) -> list[str]:
    """The comparison as text."""
    lines = [f"{'':24}{'default':>12}{'extended':>12}{'gain':>12}  95 % interval"]
    for name, gain in document["gain"].items():
        means = [document["policies"][n]["measures"][name]["mean"] for n in NAMES]
        shown = [_text(x) for x in (*means, gain["mean"])]
        bounds = f"{_text(gain['low']).strip()} to {_text(gain['high']).strip()}"
        lines.append(f"{name:24}{''.join(shown)}  {bounds}")
    return [*lines, _NOTE]


def _text(value: float | None) -> str:
    return f"{'-' if value is None else format(value, '.4g'):>12}"
