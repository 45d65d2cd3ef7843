"""`fingers sweep`: configurations × seeds × stages, trained; and how they stand."""

from __future__ import annotations

import argparse
import json
import sys
import time
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from envs.errors import InputError
from fingers_mjx.cli.arguments import options
from fingers_mjx.cli.machine.gpu import note_failed_cuda
from fingers_mjx.cli.machine.jax_ready import prepare_jax

if TYPE_CHECKING:
    from envs.config.documented import Setting
    from fingers_mjx.studies.sweep.spec import Sweep

STATUS = "status"
MISSING = 5
"""Exit status of a sweep that is over and lacks members."""
REFRESH_S = 2.0
_TABLES = (
    *("set", "configurations", "search", "grid", "stages", "promote"),
    "evaluate.set",
)
"""Fields of a specification that hold tables, for which a flag has no room."""


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
    parser.set_defaults(settings=[], check=_check, needs_jax=False)
    options.offer_settings(parser, _offered, _preview)
    what = (
        "specification of the sweep, whose fields --help after it lists, each a flag "
        "too; or the word status, and DIR after it"
    )
    options.path(parser, "spec", metavar="SPEC.yaml", help=what)
    options.path(parser, "directory", metavar="DIR", nargs="?", help="with status only")
    options.path(parser, "-o", "--out", metavar="DIR", help="directory of the sweep")


def _offered(args: argparse.Namespace) -> list[Setting]:
    """Returns the fields of a specification that hold one value or a list."""
    from envs.config.documented import settings_of

    if str(args.spec) == STATUS:
        return []
    fields = settings_of(_written(args.spec, []))
    return [field for field in fields if field.name not in _TABLES]


def _preview(args: argparse.Namespace) -> str:
    """Returns the specification with the flags put in."""
    from envs.config.typed import dump_yaml

    return dump_yaml(_written(args.spec, args.settings))


def _written(source: Path, assignments: list[str]) -> Sweep:
    """Returns the specification in a file, changed as asked."""
    from envs.config.typed import load_yaml, override
    from fingers_mjx.studies.sweep.spec import Sweep

    return override(load_yaml(Sweep, source), assignments, "arguments")


def _asks(args: argparse.Namespace) -> bool:
    """Whether the words ask how a sweep stands."""
    return str(args.spec) == STATUS and args.out is None


def _check(args: argparse.Namespace) -> None:
    """Refuses words that do not fit; a GPU is looked for as the specification says."""
    if _asks(args):
        if args.directory is None:
            raise InputError("fingers sweep status", "DIR", "", "a sweep directory")
        args.computes = False
        return
    if args.directory is not None:
        valid = "one specification, and -o DIR"
        raise InputError("fingers sweep", "DIR", args.directory, valid)
    if args.out is None and not args.dry_run:
        raise InputError("fingers sweep", "-o", "", "the directory of the sweep")
    args.written = _written(args.spec, args.settings)
    args.backend = args.written.backend


def run(args: argparse.Namespace) -> int:
    """Runs a sweep, or shows how it stands."""
    if _asks(args):
        return _show(args.directory)
    return _run(args.spec, args.written, args.out)


def _run(source: Path, written: Sweep, out: Path) -> int:
    """Runs a sweep; the report goes to stdout."""
    prepare_jax()
    import jax

    from fingers_mjx.studies.sweep.book import Book
    from fingers_mjx.studies.sweep.display import display
    from fingers_mjx.studies.sweep.engines.by_name import make_engine
    from fingers_mjx.studies.sweep.report import report
    from fingers_mjx.studies.sweep.resolve import keep_sweep, machine_backend
    from fingers_mjx.studies.sweep.run import run_sweep, sweep_lock

    # This process trains nothing; the memory of a GPU is for those that do.
    jax.config.update("jax_platforms", "cpu")
    options.check_directory("-o", out)
    root = out.absolute()
    with sweep_lock(root):
        backend = partial(machine_backend, note_failed_cuda)
        spec = keep_sweep(written, source, root, backend)
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
