"""What can be typed after `fingers sysid transfer`."""

from collections.abc import Callable
from pathlib import Path


def add_transfer(actions, whole: Callable, settings: Callable, backend: Callable):
    """Adds `fingers sysid transfer`."""
    parser = actions.add_parser(
        "transfer",
        help="measure what a found effect is worth",
        description="Trains one policy on the default hand and one on the extended "
        "hand with equal budget, then lets both walk in the simulator of the real "
        "hand: task speed, drift, survival. Writes OUT/transfer.json beside both runs.",
        allow_abbrev=False,
    )
    parser.set_defaults(module="transfer")
    parser.add_argument(
        "--real",
        type=Path,
        metavar="FILE",
        required=True,
        help="hand.yaml of the simulator that stands for the real hand",
    )
    parser.add_argument(
        "--extended", type=Path, metavar="FILE", help="hand.yaml of a diagnosis"
    )
    parser.add_argument(
        "--default", type=Path, metavar="FILE", help="default: the paper's hand"
    )
    parser.add_argument(
        "--policies",
        type=Path,
        nargs=2,
        metavar="POLICY",
        help="compare these, run directories or bundles, instead of training",
    )
    parser.add_argument("--task", metavar="TASK", default="crawl", help="default crawl")
    parser.add_argument("--preset", metavar="NAME", help="as in fingers train")
    parser.add_argument(
        "--warm-start",
        type=Path,
        metavar="RUN|BUNDLE",
        help="fine-tune this policy on both hands",
    )
    settings(parser, "a setting of both trainings, as in fingers train")
    backend(parser)
    parser.add_argument(
        "--episodes", type=whole(1), default=64, help="of each kind (default 64)"
    )
    parser.add_argument("--steps", type=whole(1), help="control steps of an episode")
    parser.add_argument("--seed", type=whole(0, 2**32 - 1), default=0, help="default 0")
    parser.add_argument(
        "-o", "--out", type=Path, metavar="OUT", default=Path("transfer")
    )
