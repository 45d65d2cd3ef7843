"""RSL-RL's PPO on the hand of mjlab until its hands stand."""

# pyright: reportMissingImports=false
from importlib.metadata import version

from benchmarks.comparison.workers.mjlab_hand import make_env, make_runner
from benchmarks.comparison.workers.mjlab_walk import Watched
from benchmarks.comparison.workers.report import STANDING_STEPS, arguments, say

ITERATIONS = 3000


class Standing:
    """Says once that ended episodes are long."""

    def __init__(self):
        self._said = False

    def over(self, length: float, speed_mps: float) -> bool:
        """Takes the means of an iteration; whether all is said."""
        if length >= STANDING_STEPS and not self._said:
            self._said = True
            about = f"mjlab {version('mjlab')}, rsl-rl-lib {version('rsl-rl-lib')}"
            about += f", warp {version('warp-lang')}, torch {version('torch')}"
            say(first=True, version=about, note="same hand standing, MuJoCo Warp")
        return self._said


def main() -> None:
    """Trains until episodes that end are long, and says so."""
    args = arguments()
    device = "cpu" if args.device == "cpu" else "cuda:0"
    made = make_env(args.mjcf, args.worlds, device, args.seed)
    env = Watched(made.env, Standing())
    make_runner(env, args.out, args.seed).learn(num_learning_iterations=ITERATIONS)
    raise SystemExit("RuntimeError: episodes stayed short to the end")


if __name__ == "__main__":
    main()
