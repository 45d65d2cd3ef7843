"""`fingers compare`: configurations of a sweep against one of them, over seeds."""

from __future__ import annotations

import argparse
import shlex
import sys
from typing import TYPE_CHECKING

from fingers_mjx.cli.arguments import options

if TYPE_CHECKING:
    from fingers_mjx.studies.comparison.comparison import Comparison


def add(commands) -> None:
    """Adds the command and its arguments."""
    parser = options.command(
        commands,
        "compare",
        run,
        "compare the configurations of a sweep over its seeds",
        "Compare the configurations of a sweep with a baseline, seed by seed. Prints "
        "one table; writes it as JSON, Parquet and one HTML page with all seeds and "
        "learning curves.",
        computes=False,
    )
    parser.set_defaults(check=_check, needs_jax=False)
    options.path(parser, "sweep", metavar="DIR", help="directory of fingers sweep")
    what = "configuration that the others are compared with"
    parser.add_argument("--baseline", metavar="NAME", help=what)
    parser.add_argument(
        "--measures",
        metavar="NAME",
        nargs="+",
        help="default: all of the task that have a better direction",
    )
    what = "where the comparison goes; default DIR/comparison"
    options.path(parser, "-o", "--out", metavar="OUT", help=what)
    parser.add_argument(
        "--allow-partial",
        action="store_true",
        help="compare what is done; seeds that are missing are left out of both arms",
    )


def _check(args: argparse.Namespace) -> None:
    """Refuses what is no sweep, before the statistics load; keeps its manifest."""
    from envs.errors import InputError
    from fingers_mjx.studies.sweep.manifest import read_manifest

    args.manifest = read_manifest(args.sweep)
    if args.baseline is None:
        names = ", ".join(args.manifest.configurations)
        raise InputError("--baseline", "", "nothing", f"one of {names}")
    args.out = args.out or args.sweep / "comparison"
    options.check_directory("--out", args.out)


def run(args: argparse.Namespace) -> int:
    """Compares; the table goes to stdout."""
    from fingers_mjx.studies.comparison.comparison import check_complete, compared
    from fingers_mjx.studies.comparison.curves import read_curves
    from fingers_mjx.studies.comparison.files import write_comparison
    from fingers_mjx.studies.comparison.page import PAGE_FILE, write_page
    from fingers_mjx.studies.comparison.results import read_results
    from fingers_mjx.studies.sweep.promote import choosing
    from fingers_mjx.studies.sweep.resolve import saved_sweep

    manifest, out = args.manifest, args.out
    chose = choosing(saved_sweep(args.sweep), manifest)
    results = read_results(args.sweep, manifest, chose)
    if not args.allow_partial:
        check_complete(results, args.sweep)
    comparison = compared(results, args.baseline, args.measures)
    write_comparison(out, comparison)
    curves = read_curves(args.sweep, manifest)
    write_page(out / PAGE_FILE, comparison, curves, [_command(args)])
    show(comparison)
    print(f"{out / PAGE_FILE}", file=sys.stderr)
    return 0


def show(comparison: Comparison) -> None:
    """Prints the table of differences, and what must be known to read it."""
    from fingers_mjx.cli.output import print_table
    from fingers_mjx.studies.comparison.tables import HEADER, difference_rows, notes

    task, baseline = comparison.results.task, comparison.baseline
    title = f"{task}: differences from {baseline}, paired over seeds"
    print_table(title, HEADER, difference_rows(comparison), names=2)
    print("\n".join(notes(comparison)))


def _command(args: argparse.Namespace) -> str:
    """The command again, as it would be typed."""
    words = ["fingers", "compare", str(args.sweep), "--baseline", args.baseline]
    words += ["--measures", *args.measures] if args.measures else []
    words += ["--allow-partial"] if args.allow_partial else []
    return shlex.join(words)
