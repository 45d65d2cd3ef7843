"""`fingers sweep`: configurations × seeds × stages, trained; and how they stand."""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path

from envs.errors import InputError
from fingers_mjx.cli import options

STATUS = "status"
MISSING = 5
"""Exit status of a sweep that is over and lacks members."""
REFRESH_S = 2.0


def add(commands) -> None:
    """Adds the command and its arguments."""
    parser = options.command(
        commands,
        "sweep",
        run,
        "train and evaluate configurations × seeds × stages",
        "Train and evaluate configurations × seeds × stages, as SPEC.yaml says; the "
        "same command goes on after it was stopped or killed. `fingers sweep status "
        "DIR` shows how the members of a sweep stand.",
    )
    what = "specification of the sweep; or the word status, and DIR after it"
    options.path(parser, "spec", metavar="SPEC.yaml", help=what)
    options.path(parser, "directory", metavar="DIR", nargs="?", help="with status only")
    options.path(parser, "-o", "--out", metavar="DIR", help="directory of the sweep")


def run(args: argparse.Namespace) -> int:
    """Runs a sweep, or shows how it stands."""
    if str(args.spec) == STATUS and args.out is None:
        if args.directory is None:
            raise InputError("fingers sweep status", "DIR", "", "a sweep directory")
        return _show(args.directory)
    if args.directory is not None:
        valid = "one specification, and -o DIR"
        raise InputError("fingers sweep", "DIR", args.directory, valid)
    if args.out is None:
        raise InputError("fingers sweep", "-o", "", "the directory of the sweep")
    return _run(args.spec, args.out)


def _run(source: Path, out: Path) -> int:
    """Runs a sweep; the report goes to stdout."""
    import jax

    from envs.config.typed import load_yaml
    from fingers_mjx.studies.sweep.book import Book
    from fingers_mjx.studies.sweep.display import display
    from fingers_mjx.studies.sweep.engines.by_name import make_engine
    from fingers_mjx.studies.sweep.report import report
    from fingers_mjx.studies.sweep.resolve import keep_sweep
    from fingers_mjx.studies.sweep.run import run_sweep, sweep_lock
    from fingers_mjx.studies.sweep.spec import Sweep

    # This process trains nothing; the memory of a GPU is for those that do.
    jax.config.update("jax_platforms", "cpu")
    options.check_directory("-o", out)
    written, root = load_yaml(Sweep, source), out.absolute()
    with sweep_lock(root):
        spec = keep_sweep(written, source, root)
        with display(sys.stdout, root) as show:
            book = Book(spec, root, show.member)
            manifest = run_sweep(book, make_engine(spec, root), show.event)
    print("\n".join(report(out, manifest)))
    return MISSING if manifest.missing() else 0


def _show(root: Path) -> int:
    """Shows how a sweep stands: live on a terminal while it runs, else JSON lines."""
    from fingers_mjx.studies.sweep.display import live_table
    from fingers_mjx.studies.sweep.status import in_progress, standings

    found = standings(root)
    if not sys.stdout.isatty():
        for one in found:
            print(json.dumps(one.event()), flush=True)
        return 0
    with live_table(sys.stdout, root):
        while in_progress(root):
            time.sleep(REFRESH_S)
    return 0
