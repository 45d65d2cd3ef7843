"""`fingers eval`: many randomized episodes of one policy, measured."""

import argparse
import dataclasses
import sys
from typing import Any

from envs.errors import InputError
from envs.physics import default_backend
from fingers_mjx.cli.output import counting
from fingers_mjx.cli.paths import check_directory, check_file
from fingers_mjx.cli.table import print_measures
from fingers_mjx.cli.train import check_backend
from fingers_mjx.evaluation.files import write_summary
from fingers_mjx.evaluation.source import (
    as_deployed,
    check_policy_settings,
    document,
    evaluate_source,
    nominal,
    with_command,
    write_evaluation,
)
from fingers_mjx.policy.source import is_run, load_source
from fingers_mjx.runs.setup import Setup, overridden


def run(args: argparse.Namespace) -> int:
    """Evaluates; the table goes to stdout, progress to stderr."""
    backend = check_backend(args.backend or default_backend())
    if len(args.commands or ()) > 1:
        raise InputError("--command", "", f"{len(args.commands)} commands", "one")
    check_policy_settings(args.settings)
    check_file("--json", args.json)
    check_directory("--out", args.out)
    loaded = load_source(args.policy)
    source = dataclasses.replace(loaded, setup=_setup(args, loaded.setup))
    with counting(sys.stderr, "evaluating", "steps") as progress:
        table = evaluate_source(
            source, args.episodes, args.seed, backend, args.steps, progress
        )
    summary = document(source, table, args.seed, _conditions(args, backend))
    out = args.out or (args.policy / "eval" if is_run(args.policy) else None)
    if out:
        write_evaluation(out, table, summary)
    if args.json:
        args.json.parent.mkdir(parents=True, exist_ok=True)
        write_summary(args.json, summary)
    print_measures(summary)
    return 0


def _setup(args: argparse.Namespace, setup: Setup) -> Setup:
    """Returns what is simulated: the policy's own task, changed as asked."""
    setup = as_deployed(nominal(setup) if args.nominal else setup)
    for command in args.commands or ():
        setup = with_command(setup, command)
    return overridden(setup, args.settings)


def _conditions(args: argparse.Namespace, backend: str) -> dict[str, Any]:
    """Returns what it takes to repeat the evaluation."""
    return {
        "backend": backend,
        "steps": args.steps,
        "command": args.commands[0] if args.commands else None,
        "nominal": args.nominal,
        "settings": args.settings,
    }
