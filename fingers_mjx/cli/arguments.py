"""What can be typed after `fingers`; light, since `--help` should answer at once."""

import argparse
import math
from collections.abc import Callable
from pathlib import Path
from typing import NoReturn

from fingers_mjx.cli.arguments_hand import add_hand
from fingers_mjx.cli.arguments_sysid import add_calibrate, add_diagnose, add_excite
from fingers_mjx.cli.arguments_transfer import add_transfer

MAX_SEED = 2**32 - 1
POLICY_HELP = "run directory, exported bundle directory or its policy.onnx"


class UsageError(Exception):
    """Words on the command line that do not fit, told in one sentence."""


class _Parser(argparse.ArgumentParser):
    """Tells a mistake in one sentence and leaves the exit to `main`."""

    def error(self, message: str) -> NoReturn:
        raise UsageError(f"{message} (see {self.prog} --help)")


def make_parser() -> argparse.ArgumentParser:
    """Returns the parser of all commands; each names its module in `args.module`."""
    parser = _Parser(
        prog="fingers",
        description="Teach an anthropomorphic hand to walk on its fingertips.",
        epilog="Exit status: 0 done, 2 bad input, 3 diverged, 4 disk full, 6 an "
        "installation that cannot work, 75 stopped by a signal after saving (go on "
        "with --resume).",
        allow_abbrev=False,
    )
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for add in (_train, _eval, _export, _play, _add_hand, _sysid, _demo):
        add(commands)
    return parser


def whole(low: int, high: int | None = None) -> Callable[[str], int]:
    """Returns a converter to whole numbers from `low` to `high`."""

    def convert(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            value = None
        if value is None or value < low or (high is not None and value > high):
            limit = f" and at most {high}" if high is not None else ""
            raise argparse.ArgumentTypeError(
                f"found {text}; valid: a whole number of at least {low}{limit}"
            )
        return value

    return convert


def number(low: float = -math.inf) -> Callable[[str], float]:
    """Returns a converter to finite numbers of at least `low`."""

    def convert(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not (math.isfinite(value) and value >= low):
            limit = f" of at least {low:g}" if low > -math.inf else ""
            raise argparse.ArgumentTypeError(
                f"found {text}; valid: a finite number{limit}"
            )
        return value

    return convert


def _command(commands, name: str, module: str, summary: str, details: str = ""):
    parser = commands.add_parser(
        name,
        help=summary,
        description=f"{summary[:1].upper()}{summary[1:]}. {details}".strip(),
        allow_abbrev=False,
    )
    parser.set_defaults(module=module)
    return parser


def _train(commands) -> None:
    parser = _command(
        commands,
        "train",
        "train",
        "train a policy",
        "Shows progress live on a terminal, as JSON lines otherwise. SIGINT saves and "
        "stops; --resume goes on.",
    )
    parser.add_argument("task", metavar="TASK", nargs="?", help="such as crawl")
    parser.add_argument(
        "--preset",
        metavar="NAME",
        help="paper (its settings), fast (one GPU) or cpu (small); default: by machine",
    )
    _settings(parser, "a setting such as ppo.entropy_cost=0.001 or env.action_clip=0.8")
    _backend(parser)
    parser.add_argument("--seed", type=whole(0, MAX_SEED), help="default 0")
    parser.add_argument(
        "--hand", type=Path, metavar="FILE", help="hand.yaml; default: the paper's hand"
    )
    parser.add_argument(
        "--out", type=Path, metavar="RUN", help="new directory; default: under runs/"
    )
    parser.add_argument(
        "--resume", type=Path, metavar="RUN", help="go on with this run"
    )
    parser.add_argument(
        "--warm-start",
        type=Path,
        metavar="RUN|BUNDLE",
        help="start from the networks of this run or checkpoint, or from the policy of "
        "a bundle, which may be of another task",
    )


def _eval(commands) -> None:
    parser = _command(
        commands,
        "eval",
        "evaluate",
        "measure a policy in many randomized episodes",
        "Prints the paper's measures; for a run directory, writes summary, table of "
        "episodes and figures to RUN/eval unless --out says otherwise.",
    )
    parser.add_argument("policy", metavar="POLICY", type=Path, help=POLICY_HELP)
    _episodes(parser, 256)
    _seed(parser)
    _steps(parser)
    _fixed_command(parser, "m/s, m/s, rad/s in V, for all of every episode")
    _backend(parser)
    parser.add_argument(
        "--nominal", action="store_true", help="the nominal hand, without noise"
    )
    _settings(parser, "a setting of the task such as env.episode_s=10")
    _json(parser)
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="summary, table and figures go here"
    )


def _export(commands) -> None:
    parser = _command(
        commands,
        "export",
        "export",
        "write the policy of a run as a bundle",
        "policy.onnx, manifest.json, config.yaml and hand.yaml; fails if ONNX Runtime "
        "and JAX differ by more than 1e-5.",
    )
    parser.add_argument("run_dir", metavar="RUN", type=Path, help="run directory")
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="directory of the bundle; default RUN"
    )


def _play(commands) -> None:
    parser = _command(
        commands,
        "play",
        "play",
        "close the loop in plain C MuJoCo through the deployment shim",
        "Physics at 200 Hz, the exported policy at 50 Hz through fingers_deploy; the "
        "training environment takes no part.",
    )
    parser.add_argument(
        "bundle", metavar="BUNDLE", type=Path, help="bundle directory or policy.onnx"
    )
    parser.add_argument(
        "--then",
        type=Path,
        metavar="BUNDLE",
        help="after a recovery: policy that takes over once the hand stands, under "
        "--command (default: its fastest forward)",
    )
    parser.add_argument(
        "--keys",
        metavar="KEY,KEY",
        help="keyboard: what to press, out of left, down, right, up",
    )
    parser.add_argument(
        "--level",
        choices=("one-box", "two-boxes"),
        help="keyboard: a Sokoban level, its shortest solution pressed key by key",
    )
    parser.add_argument(
        "--retries",
        type=whole(0, 10),
        default=0,
        help="keyboard: ask again after a time-out (default 0)",
    )
    parser.add_argument(
        "--video", type=Path, metavar="FILE", help=".mp4, .webp or .gif to write"
    )
    parser.add_argument(
        "--seconds", type=number(0.1), default=20.0, help="length (default 20)"
    )
    _episodes(parser, 1)
    _seed(parser)
    what = "m/s, m/s, rad/s in V; given several times, they share the time equally"
    _fixed_command(parser, what)
    parser.add_argument(
        "--randomize",
        action="store_true",
        help="worlds, sensor noise and starts as drawn in training; else the nominal "
        "hand",
    )
    parser.add_argument(
        "--friction", type=number(0.0), metavar="MU", help="friction of the fingertips"
    )
    parser.add_argument(
        "--runtime",
        choices=("auto", "onnxruntime", "numpy"),
        default="auto",
        help="what runs the policy",
    )
    parser.add_argument(
        "--fps", type=number(1.0), default=25.0, help="frames per second (default 25)"
    )
    parser.add_argument(
        "--width", type=whole(64, 4096), default=640, help="of the video (default 640)"
    )
    _json(parser)


def _add_hand(commands) -> None:
    summary = "look at the hand and its stance, or bring a hand of your own"
    add_hand(_command(commands, "hand", "hand", summary), _seed, whole)


def _sysid(commands) -> None:
    parser = _command(commands, "sysid", "log_info", "look at measured logs")
    actions = parser.add_subparsers(metavar="ACTION", required=True, dest="action")
    info = actions.add_parser(
        "info",
        help="tell what a log holds",
        description="Tells joints, columns, ranges, rates, gaps and clock steps.",
    )
    info.add_argument("log", type=Path, metavar="LOG", help="CSV, Parquet, MCAP, bag")
    info.add_argument(
        "--map", type=Path, metavar="FILE", help="topics and names of a bag, as YAML"
    )
    add_excite(actions, whole, number)
    add_calibrate(actions)
    add_diagnose(actions, whole, number)
    add_transfer(actions, whole, _settings, _backend)


def _demo(commands) -> None:
    parser = _command(
        commands,
        "demo",
        "demo",
        "see everything once, in minutes, without a GPU",
        "Evaluates and plays the committed policy, trains a small one, exports it, and "
        "writes one report.html.",
    )
    parser.add_argument("--out", type=Path, metavar="DIR", default=Path("demo"))
    parser.add_argument(
        "--policy",
        type=Path,
        metavar="BUNDLE",
        help="bundle to evaluate and play; default: the committed crawl policy",
    )


def _settings(parser, what: str) -> None:
    parser.add_argument(
        "--set",
        dest="settings",
        metavar="FIELD=VALUE",
        nargs="+",
        action="extend",
        default=[],
        help=what,
    )


def _backend(parser) -> None:
    parser.add_argument(
        "--backend",
        metavar="NAME",
        help="cpu, jax or warp; default: warp with an NVIDIA GPU, else cpu",
    )


def _episodes(parser, default: int) -> None:
    parser.add_argument(
        "--episodes", type=whole(1), default=default, help=f"default {default}"
    )


def _seed(parser) -> None:
    parser.add_argument("--seed", type=whole(0, MAX_SEED), default=0, help="default 0")


def _steps(parser) -> None:
    parser.add_argument(
        "--steps",
        type=whole(1),
        metavar="N",
        help="control steps of an episode; default: as in training",
    )


def _fixed_command(parser, what: str) -> None:
    parser.add_argument(
        "--command",
        dest="commands",
        type=number(),
        nargs=3,
        action="append",
        metavar=("VX", "VY", "WZ"),
        help=f"{what}; default: drawn as in training",
    )


def _json(parser) -> None:
    parser.add_argument("--json", type=Path, metavar="FILE", help="summary to write")
