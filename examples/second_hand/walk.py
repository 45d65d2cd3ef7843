"""Stands, trains, evaluates, exports and films another hand: `walk.py HAND --out DIR`.

Every step is a command of `fingers`, which is printed before it runs. A step whose
result is there is not done again, and training goes on where it was stopped; what
comes after a training that is done needs no GPU.
"""

import argparse
import shlex
import sys
from collections.abc import Iterator
from pathlib import Path

from fingers_mjx.cli.main import main as fingers
from fingers_mjx.reports.figures import training_curves
from fingers_mjx.runs.metrics import read_metrics

CURVES = {
    "task_speed_mps": "task speed [m/s]",
    "episode/return": "mean return",
    "episode/length": "length of an episode [steps]",
}


def commands(given: argparse.Namespace) -> Iterator[tuple[Path, list[str]]]:
    """Yields the result of each step, and the arguments of `fingers` that make it."""
    out, hand = given.out, str(given.hand)
    run, bundle = out / "run", out / "bundle"
    yield (
        out / "stance/left.png",
        ["hand", "show", "--hand", hand, "--out", f"{out}/stance"],
    )
    train = [
        "train",
        "crawl",
        "--hand",
        hand,
        "--preset",
        given.preset,
        "--out",
        str(run),
    ]
    train += ["--seed", str(given.seed), *(["--set", *given.set] if given.set else [])]
    yield out / "curve.png", ["train", "--resume", str(run)] if run.exists() else train
    yield bundle / "policy.onnx", ["export", str(run), "--out", str(bundle)]
    test = ["--episodes", str(given.episodes), "--json", f"{out}/eval.json"]
    yield out / "eval.json", ["eval", str(bundle), *test]
    film = ["--seconds", str(given.seconds), "--command", "0.1", "0", "0"]
    film += ["--fps", "20", "--width", "480", "--video", f"{out}/walk.webp"]
    yield out / "walk.webp", ["play", str(bundle), *film]


def main(argv: list[str] | None = None) -> int:
    """Does what is not done yet; the exit status is that of a command that fails."""
    given = _parser().parse_args(argv)
    for result, arguments in commands(given):
        if result.exists():
            print(f"# {result} is there", flush=True)
            continue
        run = given.out / "run"
        if arguments[0] != "train" or not _finished(run):
            print(f"$ fingers {shlex.join(arguments)}", flush=True)
            if status := fingers(arguments):
                return status
        if arguments[0] == "train":
            _draw(run, result)
    return 0


def _finished(run: Path) -> bool:
    """Whether nothing is left to train, so that no GPU is needed for the rest."""
    metrics = run / "metrics.jsonl"
    rows = read_metrics(metrics) if metrics.exists() else []
    return bool(rows) and rows[-1]["iteration"] == rows[-1]["iterations"]


def _draw(run: Path, picture: Path) -> None:
    """Draws the learning curve."""
    rows = read_metrics(run / "metrics.jsonl")
    training_curves({"crawl": rows}, CURVES, "env_steps").savefig(picture)
    print(f"wrote {picture}", flush=True)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "hand", metavar="HAND", type=Path, help="of `fingers hand import`"
    )
    parser.add_argument("--out", metavar="DIR", type=Path, required=True)
    parser.add_argument("--preset", default="cpu", help="cpu (default), fast or paper")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument(
        "--set", nargs="+", metavar="FIELD=VALUE", help="of the training"
    )
    parser.add_argument("--episodes", type=int, default=64, help="of the evaluation")
    parser.add_argument("--seconds", type=float, default=8.0, help="of the film")
    return parser


if __name__ == "__main__":
    sys.exit(main())
