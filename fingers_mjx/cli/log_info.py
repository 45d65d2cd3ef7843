"""`fingers sysid info`."""

import argparse

from envs.config.typed import load_yaml
from sysid.logs.bag import BagMap
from sysid.logs.info import info_lines
from sysid.logs.read import read_log


def run(args: argparse.Namespace) -> int:
    """Shows what a measured log holds."""
    bag_map = load_yaml(BagMap, args.map) if args.map else None
    print("\n".join(info_lines(read_log(args.log, bag_map))))
    return 0
