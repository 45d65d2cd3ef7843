"""`fingers sysid transfer`: what modelling an effect gains on the real hand."""

from __future__ import annotations

import argparse
import itertools
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from envs.config.atomic_file import write_atomic
from envs.errors import InputError
from fingers_mjx.cli.arguments import options
from fingers_mjx.cli.arguments.inputs import check_hand, check_start

if TYPE_CHECKING:
    from fingers_mjx.policy.source import PolicySource
    from fingers_mjx.runs.settings import Settings
    from fingers_mjx.studies.transfer import Evaluated

NAMES: tuple[str, str] = ("default", "extended")

SEEDS = 3
"""Trainings on each hand, unless said otherwise."""

_NOTE = (
    "gain: extended less default, mean over the seeds, of drifts of their size; "
    "p, Holm is corrected for all rows"
)
_OVER_WORLDS = (
    "another seed may turn each row around; over_worlds in transfer.json has intervals "
    "for these two policies, and for no other trainings"
)


def add(actions) -> None:
    """Adds the action and its arguments."""
    parser = options.command(
        actions,
        "transfer",
        run,
        "measure what modelling an effect gains",
        "Trains policies on the default hand and on the extended hand with equal seeds "
        "and budget, then lets all walk in the simulator of the real hand: task speed, "
        "drift, survival. Writes OUT/transfer.json beside the runs. The same command "
        "goes on with what is not trained yet.",
    )
    parser.set_defaults(check=_check)
    what = "hand.yaml of the simulator that stands for the real hand"
    options.path(parser, "--real", required=True, help=what)
    options.path(parser, "--extended", help="hand.yaml of a diagnosis")
    options.path(parser, "--default", help="default: the paper's hand")
    parser.add_argument(
        "--policies",
        type=Path,
        nargs=2,
        action="append",
        metavar=("DEFAULT", "EXTENDED"),
        help="compare these, run directories or bundles, instead of training; again "
        "for each further pair",
    )
    parser.add_argument(
        "--seeds",
        type=options.whole(1),
        metavar="N",
        help=f"trainings on each hand, with the seeds from --seed on (default {SEEDS})",
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


def _check(args: argparse.Namespace) -> None:
    """Refuses what cannot be compared or trained, before JAX loads."""
    from fingers_mjx.policy.place import check_kind

    options.check_backend(args.backend)
    options.check_directory("--out", args.out)
    if (args.policies is None) == (args.extended is None):
        found = "both" if args.policies else "neither"
        valid = "hands to train on (--extended) or trained policies (--policies)"
        raise InputError("transfer", "", found, valid)
    if args.policies and args.seeds is not None:
        valid = "none with --policies: every pair is a seed"
        raise InputError("--seeds", "", args.seeds, valid)
    for path in (args.real, args.extended, args.default):
        check_hand(path)
    for path in itertools.chain(*(args.policies or ())):
        check_kind(path)
    if args.policies is None:
        check_start(args.warm_start)
        _settings(args, args.backend or "cpu")


def run(args: argparse.Namespace) -> int:
    """Trains both policies, unless they are given, and compares them."""
    from envs.hand.hand_file import load_hand_file
    from fingers_mjx.policy.source import load_source
    from fingers_mjx.studies.transfer import compared, in_real_hand

    backend = options.backend_of(args)
    real = load_hand_file(args.real)
    pairs = args.policies or _trained(args)
    sources: dict[str, list[PolicySource]] = {
        name: [load_source(pair[arm]) for pair in pairs]
        for arm, name in enumerate(NAMES)
    }
    _check_alike([source for arm in sources.values() for source in arm])
    seeds = range(len(pairs)) if args.policies else _seeds(args)
    evaluated: dict[str, list[Evaluated]] = {name: [] for name in NAMES}
    for name, arm in sources.items():
        for seed, source in zip(seeds, arm, strict=True):
            print(f"{name} policy {seed} in the real hand", file=sys.stderr)
            how = (real, args.episodes, args.seed, backend, args.steps)
            evaluated[name].append(in_real_hand(source, *how))
    conditions = {
        "backend": backend,
        "episodes": args.episodes,
        "steps": args.steps,
        "real_sha256": real.sha256,
    }
    document = compared(sources, evaluated, seeds, args.seed, conditions)
    args.out.mkdir(parents=True, exist_ok=True)
    text = json.dumps(document, indent=2, allow_nan=False)
    write_atomic(args.out / "transfer.json", text)
    print_gains(document)
    return 0


def _seeds(args: argparse.Namespace) -> range:
    """Seeds of the trainings."""
    return range(args.seed, args.seed + (args.seeds or SEEDS))


def _settings(args: argparse.Namespace, backend: str) -> Settings:
    """Settings of the trainings."""
    from fingers_mjx.runs.settings import new_settings, overridden

    config = options.train_config(args, backend, args.seed)
    return overridden(new_settings(config), args.settings)


def _trained(args: argparse.Namespace) -> list[list[Path]]:
    """Trains what is not trained yet; returns the two runs of each seed."""
    from envs.hand.hand_file import DEFAULT_HAND_FILE, load_hand_file
    from fingers_mjx.runs.setup import with_hand, with_seed
    from fingers_mjx.studies.transfer import train_on
    from fingers_mjx.training.progress import reporter

    settings = _settings(args, options.backend_of(args))
    setup = with_hand(settings, load_hand_file(args.default or DEFAULT_HAND_FILE))
    hands = {"default": setup.hand, "extended": load_hand_file(args.extended)}
    if hands["default"].sha256 == hands["extended"].sha256:
        valid = "another hand than the default one"
        raise InputError("--extended", "", "the same hand", valid)
    pairs = [[args.out / name / str(seed) for name in hands] for seed in _seeds(args)]
    with reporter(sys.stdout) as show:
        for seed, paths in zip(_seeds(args), pairs, strict=True):
            own = with_seed(setup, seed)
            for path, (name, hand) in zip(paths, hands.items(), strict=True):
                text = f"training on the {name} hand, seed {seed}"
                show({"event": "note", "text": text})
                train_on(own, hand, path, args.warm_start, show)
    return pairs


def _check_alike(sources: list[PolicySource]) -> None:
    """Refuses to compare policies of different tasks or with different budgets."""
    first = sources[0]
    for other in sources[1:]:
        for what, a, b in (
            ("task", first.setup.train.task, other.setup.train.task),
            ("steps of training", first.steps_trained, other.steps_trained),
        ):
            if a != b:
                raise InputError(other.path, what, b, f"{a}, as the first policy")


def print_gains(document: dict[str, Any]) -> None:
    """Prints the comparison.

    Args:
        document: of `fingers_mjx.studies.transfer.compared`.
    """
    from fingers_mjx.cli.output import print_table
    from fingers_mjx.studies.comparison.tables import ARROWS, interval, short
    from fingers_mjx.studies.statistics.compare import ONE_SEED

    header = ("measure", *NAMES, "gain", "95 % interval", "in favour", "p, Holm",
              "detectable")  # fmt: skip
    rows = []
    for name, gain in document["gain"].items():
        numbers = (*(_mean(gain["values"][arm]) for arm in NAMES), gain["mean"])
        favour = "–" if gain["in_favour"] is None else gain["in_favour"]
        rows.append(
            (
                f"{name} {ARROWS[gain['better']]}",
                *map(short, numbers),
                interval(gain["low"], gain["high"]),
                f"{favour} of {gain['n']}",
                short(gain["p_holm"]),
                short(gain["detectable"]),
            )
        )
    seeds = len(document["seeds"])
    print_table(f"in the real hand; trainings on each: {seeds}", header, rows)
    print(_NOTE if seeds > 1 else f"{ONE_SEED}: {_OVER_WORLDS}")


def _mean(values: list[float | None]) -> float | None:
    """Mean of an arm over its policies; None if one does not define the measure."""
    known = [value for value in values if value is not None]
    return sum(known) / len(known) if len(known) == len(values) else None
