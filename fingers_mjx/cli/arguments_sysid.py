"""What can be typed after `fingers sysid excite`, `diagnose` and `calibrate`."""

from collections.abc import Callable
from pathlib import Path


def add_excite(actions, whole: Callable, number: Callable) -> None:
    """Adds `fingers sysid excite`."""
    parser = actions.add_parser(
        "excite",
        help="plan what to record",
        description="Plans motions that show what a joint is: targets.csv to play and "
        "plan.yaml with what every part is for, the limits that the model keeps under "
        "it, and which effects it can show and tell apart.",
        allow_abbrev=False,
    )
    parser.set_defaults(module="excite")
    add_mechanism(parser)
    parser.add_argument(
        "--joints",
        nargs="+",
        default=[],
        metavar="NAME",
        help="joints one by one, or groups that move together: a finger, flexion, "
        "abduction, pip, dip; default: all joints one by one",
    )
    parser.add_argument(
        "--waves",
        nargs="+",
        metavar="NAME",
        help="slow_triangle small_triangle ramps steps pulses chirp multisine holds; "
        "default: all",
    )
    parser.add_argument(
        "--rate", type=number(1.0), default=100.0, help="targets in a second"
    )
    parser.add_argument("--repeats", type=whole(1, 100), default=3, help="default 3")
    parser.add_argument(
        "--stretch", type=number(0.1), default=1.0, help="factor on usual lengths"
    )
    parser.add_argument("--seed", type=whole(0, 2**32 - 1), default=0, help="default 0")
    parser.add_argument(
        "--reach", type=number(0.0), default=0.5, help="largest excursion [rad]"
    )
    parser.add_argument(
        "--speed", type=number(0.0), default=4.0, help="largest speed [rad/s]"
    )
    parser.add_argument(
        "--torque-share",
        type=number(0.0),
        default=0.9,
        help="largest share of the torque (or current) limit (default 0.9)",
    )
    parser.add_argument(
        "--no-effects",
        action="store_true",
        help="leave out which effects it shows, which takes most of the time",
    )
    parser.add_argument("-o", "--out", type=Path, metavar="DIR", default=Path("excite"))


def add_calibrate(actions) -> None:
    """Adds `fingers sysid calibrate`."""
    parser = actions.add_parser(
        "calibrate",
        help="measure stiffness, delay, cutoff, speed and tip friction",
        description="Fits Table I to records of a hand on a stand: stiffness, delay, "
        "cutoff and speed of every joint that moves, and the friction of fingertips "
        "from loaded pulls (logs with a setting normal_n and a column "
        "force.<finger>). Writes hand.yaml, calibration.json and pictures.",
        allow_abbrev=False,
    )
    parser.set_defaults(module="calibrate")
    parser.add_argument(
        "logs", type=Path, nargs="+", metavar="LOG", help="CSV, Parquet, MCAP, bag"
    )
    parser.add_argument(
        "--map", type=Path, metavar="FILE", help="topics and names of a bag, as YAML"
    )
    add_mechanism(parser)
    parser.add_argument(
        "-o", "--out", type=Path, metavar="DIR", default=Path("calibration")
    )


def add_mechanism(parser) -> None:
    """Adds what says which mechanism it is."""
    parser.add_argument(
        "--hand", type=Path, metavar="FILE", help="hand.yaml; default: the paper's hand"
    )
    parser.add_argument(
        "--mjcf", type=Path, metavar="FILE", help="another mechanism, with --drive"
    )
    parser.add_argument("--drive", type=Path, metavar="FILE", help="drive.yaml")


def add_diagnose(actions, whole: Callable, number: Callable) -> None:
    """Adds `fingers sysid diagnose`."""
    parser = actions.add_parser(
        "diagnose",
        help="name what the simulation lacks",
        description="Compares records with the simulation and names the effects that "
        "it lacks: OUT/diagnosis.json, OUT/report.html and, for the hand, "
        "OUT/hand.yaml with the effects in it.",
        allow_abbrev=False,
    )
    parser.set_defaults(module="diagnose")
    parser.add_argument(
        "logs", nargs="+", type=Path, metavar="LOG", help="CSV, Parquet, MCAP, bag"
    )
    add_mechanism(parser)
    parser.add_argument(
        "--map", type=Path, metavar="FILE", help="topics and names of a bag, as YAML"
    )
    parser.add_argument("--seed", type=whole(0, 2**32 - 1), default=0, help="default 0")
    parser.add_argument(
        "--no-report", action="store_true", help="without OUT/report.html"
    )
    parser.add_argument(
        "-o", "--out", type=Path, metavar="OUT", default=Path("diagnosis")
    )
