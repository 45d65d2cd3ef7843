"""What can be typed after `fingers hand`."""

from collections.abc import Callable
from pathlib import Path

STANCE_STARTS = 40
"""Starts with which the stored stance was found."""


def add_hand(parser, seed: Callable, whole: Callable) -> None:
    """Adds the actions of `fingers hand`."""
    actions = parser.add_subparsers(metavar="ACTION", required=True, dest="action")
    show = actions.add_parser(
        "show",
        help="draw the stance from four sides",
        description="Draws the stance from four sides, with the control frame V, "
        "fingertips, pad normals and support polygon.",
    )
    show.add_argument("--out", type=Path, metavar="DIR", default=Path("hand"))
    stance = actions.add_parser(
        "stance",
        help="search the stance again",
        description="Searches the stance, settles it for 4 s and prints it as JSON.",
    )
    seed(stance)
    stance.add_argument(
        "--starts",
        type=whole(1),
        default=STANCE_STARTS,
        help=f"random starts of the search (default {STANCE_STARTS})",
    )
    stance.add_argument("--out", type=Path, metavar="FILE", help="instead of stdout")
    mjcf = actions.add_parser(
        "mjcf",
        help="write the hand as MJCF",
        description="Writes the hand, standing, as one MJCF file: the model for "
        "fingers-deploy run --driver sim, or to look at in any MuJoCo viewer.",
    )
    mjcf.add_argument(
        "-o", "--out", type=Path, metavar="FILE", help="instead of stdout"
    )
    for action in (show, stance, mjcf):
        action.add_argument(
            "--hand", type=Path, metavar="FILE", help="default: the paper's hand"
        )
    _import(actions)


def _import(actions) -> None:
    parser = actions.add_parser(
        "import",
        help="make a hand file of an MJCF of your own",
        description="Carries an MJCF of the hand, such as the vendor's with meshes, "
        "over into a hand file for --hand: kinematics, inertia, limits and gains are "
        "its own, collision shapes are fitted to it. Says what it lacks.",
        allow_abbrev=False,
    )
    parser.set_defaults(module="hand_import")
    parser.add_argument("mjcf", type=Path, metavar="MJCF", help="such as vendor.xml")
    parser.add_argument(
        "--joint-map",
        type=Path,
        metavar="FILE",
        help="YAML: joints, our names to the model's; palm_quat, where asked for",
    )
    parser.add_argument(
        "-o", "--out", type=Path, metavar="FILE", required=True, help="hand file"
    )
