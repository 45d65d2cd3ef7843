"""`fingers eval`: many randomized episodes of one policy, measured."""

from __future__ import annotations

import argparse
import dataclasses
import sys
from typing import TYPE_CHECKING, Any

from envs.errors import InputError
from fingers_mjx.cli.arguments import options

if TYPE_CHECKING:
    from fingers_mjx.runs.setup import Setup


def add(commands) -> None:
    """Adds the command and its arguments."""
    parser = options.command(
        commands,
        "eval",
        run,
        "measure a policy in many randomized episodes",
        "Measure a policy in many randomized episodes. Prints the paper's measures; "
        "for a run directory, writes summary, table of episodes and figures to "
        "RUN/eval unless --out says otherwise.",
    )
    parser.set_defaults(check=_check)
    options.offer_settings(parser, options.policy_settings, _preview)
    options.path(parser, "policy", metavar="POLICY", help=options.POLICY_HELP)
    options.episodes(parser, 256)
    options.seed(parser)
    parser.add_argument(
        "--steps",
        type=options.whole(1),
        metavar="N",
        help="control steps of an episode; default: as in training",
    )
    options.fixed_command(parser, "m/s, m/s, rad/s in V, for all of every episode")
    options.backend(parser)
    parser.add_argument(
        "--nominal", action="store_true", help="the nominal hand, without noise"
    )
    options.settings(parser, options.TASK_SETTING_HELP)
    options.path(parser, "--json", help="summary to write")
    what = "summary, table and figures go here"
    options.path(parser, "--out", metavar="DIR", help=what)


def _check(args: argparse.Namespace) -> None:
    """Refuses what cannot be measured or kept, before JAX loads."""
    options.check_policy(args)
    if len(args.commands or ()) > 1:
        raise InputError("--command", "", f"{len(args.commands)} commands", "one")
    options.check_file("--json", args.json)
    options.check_directory("--out", args.out)


def run(args: argparse.Namespace) -> int:
    """Evaluates; the table goes to stdout, progress to stderr."""
    from fingers_mjx.cli.output import keep_summary, print_measures
    from fingers_mjx.evaluation import source as evaluation
    from fingers_mjx.policy.place import is_run
    from fingers_mjx.policy.source import load_source
    from fingers_mjx.training.counting import counting

    backend = options.backend_of(args)
    loaded = load_source(args.policy)
    source = dataclasses.replace(loaded, setup=_setup(args, loaded.setup))
    with counting(sys.stderr, "evaluating", "steps") as progress:
        table = evaluation.evaluate_source(
            source, args.episodes, args.seed, backend, args.steps, progress
        )
    conditions = _conditions(args, backend)
    summary = evaluation.document(source, table, args.seed, conditions)
    out = args.out or (args.policy / "eval" if is_run(args.policy) else None)
    if out:
        evaluation.write_evaluation(out, table, summary)
    keep_summary(args.json, summary)
    print_measures(summary)
    return 0


def _preview(args: argparse.Namespace) -> str:
    """Returns what would be simulated, as a `config.yaml`."""
    from fingers_mjx.policy.trained_in import trained_in
    from fingers_mjx.runs.settings import settings_yaml

    return settings_yaml(_setup(args, trained_in(args.policy)))


def _setup(args: argparse.Namespace, setup: Setup) -> Setup:
    """Returns what is simulated: the policy's own task, changed as asked."""
    from fingers_mjx.evaluation.setups import as_deployed, nominal, with_command
    from fingers_mjx.runs.settings import overridden

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
