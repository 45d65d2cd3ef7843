"""`fingers log convert`: measured logs from one format to another."""

from __future__ import annotations

import argparse

from fingers_mjx.cli.arguments import options
from fingers_mjx.cli.sysid import records


def add(commands) -> None:
    """Adds the command and its action."""
    summary = "convert measured logs between formats"
    parser = commands.add_parser("log", help=summary, description=f"C{summary[1:]}.")
    actions = parser.add_subparsers(metavar="ACTION", required=True)
    convert = options.command(
        actions,
        "convert",
        run,
        "write a log in another format",
        "Write a log in another format: CSV, Parquet, MCAP by the suffix of OUT, or "
        "with --to the folder of a ROS 2 bag or of a LeRobot dataset. What OUT cannot "
        "hold is refused; everything else is read back to the bit.",
        computes=False,
    )
    convert.set_defaults(needs_jax=False)
    records.logs(convert, "log")
    options.path(convert, "out", metavar="OUT", help="file or folder to write")
    convert.add_argument(
        "--to", choices=("bag", "lerobot"), help="a folder of this format"
    )
    what = "YAML header of a log, for a LeRobot dataset that others wrote"
    options.path(convert, "--header", help=what)
    what = "of a LeRobot dataset that others wrote"
    options.value(convert, "--episode", options.whole(0), 0, what)


def run(args: argparse.Namespace) -> int:
    """Converts, and says what was written."""
    from envs.config.typed import load_yaml
    from sysid.logs.lerobot import read_lerobot
    from sysid.logs.log import LogHeader
    from sysid.logs.read import write_log

    if args.to is None:
        options.check_file("OUT", args.out)
    else:
        options.check_directory("OUT", args.out)
    if args.header is not None:
        header = load_yaml(LogHeader, args.header)
        log = read_lerobot(args.log, header, args.episode)
    else:
        (log,) = records.read([args.log], args.map)
    write_log(log, args.out, args.to)
    print(f"wrote {args.out}: {len(log)} rows, {len(log.columns)} columns")
    return 0
