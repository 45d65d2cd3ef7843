"""RSL-RL's PPO on the hand of mjlab until its hands stand."""

# pyright: reportMissingImports=false
from benchmarks.comparison.workers.mjlab.hand import make_env, make_runner, versions
from benchmarks.comparison.workers.mjlab.watched import Seen, Watched
from benchmarks.comparison.workers.report import STANDING_STEPS, arguments, say

ITERATIONS = 3000


def main() -> None:
    """Trains until episodes that end are long, and says so."""
    args = arguments()
    device = "cpu" if args.device == "cpu" else "cuda:0"
    said = []

    def look(seen: Seen) -> None:
        if not said and seen.length >= STANDING_STEPS:
            said.append(seen)
            say(first=True, version=versions(), note="same hand standing, MuJoCo Warp")

    env = Watched(make_env(args.mjcf, args.worlds, device, args.seed).env, look)
    make_runner(env, args.out, args.seed).learn(num_learning_iterations=ITERATIONS)
    raise SystemExit("RuntimeError: episodes stayed short to the end")


if __name__ == "__main__":
    main()
