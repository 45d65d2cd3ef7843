"""`fingers sysid transfer`: what modelling an effect gains on the real hand."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from envs.config.atomic_file import write_atomic
from envs.errors import InputError
from fingers_mjx.cli import options

if TYPE_CHECKING:
    from fingers_mjx.policy.source import PolicySource

NAMES: tuple[str, str] = ("default", "extended")

_NOTE = (
    "gain of drift_deg_s and sideways_mps: change of their size; intervals are over "
    "worlds, for this pair of trainings"
)


def add(actions) -> None:
    """Adds the action and its arguments."""
    parser = options.command(
        actions,
        "transfer",
        run,
        "measure what modelling an effect gains",
        "Trains one policy on the default hand and one on the extended hand with equal "
        "budget, then lets both walk in the simulator of the real hand: task speed, "
        "drift, survival. Writes OUT/transfer.json beside both runs.",
    )
    what = "hand.yaml of the simulator that stands for the real hand"
    options.path(parser, "--real", required=True, help=what)
    options.path(parser, "--extended", help="hand.yaml of a diagnosis")
    options.path(parser, "--default", help="default: the paper's hand")
    options.path(
        parser,
        "--policies",
        nargs=2,
        metavar="POLICY",
        help="compare these, run directories or bundles, instead of training",
    )
    parser.add_argument("--task", metavar="TASK", default="crawl", help="default crawl")
    parser.add_argument("--preset", metavar="NAME", help="as in fingers train")
    what = "fine-tune this policy on both hands"
    options.path(parser, "--warm-start", metavar="RUN|BUNDLE", help=what)
    options.settings(parser, "a setting of both trainings, as in fingers train")
    options.backend(parser)
    options.value(parser, "--episodes", options.whole(1), 64, "of each kind")
    parser.add_argument(
        "--steps", type=options.whole(1), help="control steps of an episode"
    )
    options.seed(parser)
    options.path(parser, "-o", "--out", metavar="OUT", default=Path("transfer"))


def run(args: argparse.Namespace) -> int:
    """Trains both policies, unless they are given, and compares them."""
    from envs.hand.hand_file import load_hand_file
    from fingers_mjx.policy.source import load_source
    from fingers_mjx.studies.transfer import compared, in_real_hand

    backend = options.backend_of(args)
    options.check_directory("--out", args.out)
    if (args.policies is None) == (args.extended is None):
        found = "both" if args.policies else "neither"
        valid = "hands to train on (--extended) or trained policies (--policies)"
        raise InputError("transfer", "", found, valid)
    real = load_hand_file(args.real)
    loaded = map(load_source, args.policies or _trained(args))
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


def _trained(args: argparse.Namespace) -> list[Path]:
    """Trains both, with the same settings and the same seed."""
    from envs.hand.hand_file import load_hand_file
    from fingers_mjx.runs.setup import new_setup, overridden
    from fingers_mjx.studies.transfer import train_on
    from fingers_mjx.training.progress import reporter

    config = options.train_config(args, args.seed)
    setup = overridden(new_setup(config, args.default), args.settings)
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
