"""What the actions of `fingers sysid` work on: a mechanism and its records."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from envs.errors import InputError
from fingers_mjx.cli.arguments import options
from fingers_mjx.cli.arguments.inputs import check_hand

if TYPE_CHECKING:
    from sysid.logs.log import MeasuredLog
    from sysid.mechanism import Mechanism


def logs(parser, *names: str, **how) -> None:
    """Adds the logs, and `--map` for those that are bags."""
    options.path(parser, *names, metavar="LOG", help="CSV, Parquet, MCAP, bag", **how)
    options.path(parser, "--map", help="topics and names of a bag, as YAML")


def mechanism(parser) -> None:
    """Adds the options that name the mechanism."""
    options.path(parser, "--hand", help="hand.yaml; default: the paper's hand")
    options.path(parser, "--mjcf", help="another mechanism, with --drive")
    options.path(parser, "--drive", help="drive.yaml")


def check(args: argparse.Namespace) -> None:
    """Refuses a mechanism or logs that cannot be read, before JAX loads.

    Args:
        args: of an action with both; the logs are kept in `records`, since they may
            be large.

    Raises:
        InputError: as `check_arguments` and `read`.
    """
    check_arguments(args)
    args.records = read(args.logs, args.map)


def check_arguments(args: argparse.Namespace) -> None:
    """Refuses files that name no mechanism, and where nothing can be written.

    That is before JAX loads. What an MJCF compiles to and what its drives are is found
    later: the effects of drives load JAX.

    Args:
        args: of an action with a mechanism, and a directory for what it writes.

    Raises:
        InputError: an MJCF without drives, drives without an MJCF, or both kinds; a
            file that cannot be read, or a directory that cannot be written.
    """
    from envs.config.strict_yaml import MAX_YAML_BYTES
    from envs.hand.importing.files import check_files
    from fingers_deploy.files import open_regular

    options.check_directory("-o", args.out)
    if (args.mjcf is None) != (args.drive is None) or (args.mjcf and args.hand):
        found = " ".join(f"--{n}" for n in ("hand", "mjcf", "drive") if vars(args)[n])
        raise InputError("arguments", "", found, "--hand, or --mjcf with --drive")
    check_hand(args.hand)
    if args.mjcf is not None:
        check_files(args.mjcf)
        open_regular(args.drive, MAX_YAML_BYTES).close()


def read(paths: list[Path], map_file: Path | None) -> list[MeasuredLog]:
    """Reads logs; a map belongs to the bags among them.

    Raises:
        InputError: a file that is no log, or a map although there is no bag.
    """
    from envs.config.typed import load_yaml
    from sysid.logs.bag import BagMap
    from sysid.logs.read import read_log

    bag_map = load_yaml(BagMap, map_file) if map_file else None
    bags = [path.is_dir() or path.suffix == ".mcap" for path in paths]
    return [
        read_log(path, bag_map if is_bag or not any(bags) else None)
        for path, is_bag in zip(paths, bags, strict=True)
    ]


def mechanism_of(args: argparse.Namespace) -> Mechanism:
    """Returns the mechanism that the arguments name, which `check_arguments` let pass.

    Raises:
        InputError: files that are no mechanism.
    """
    from envs.hand.hand_file import load_hand_file
    from sysid.mechanism import hand_mechanism, mjcf_mechanism

    if args.mjcf is not None:
        return mjcf_mechanism(args.mjcf, args.drive)
    return hand_mechanism(load_hand_file(args.hand) if args.hand else None)
