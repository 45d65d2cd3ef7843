"""RSL-RL's PPO on the hand of mjlab, paid for walking, for a given time."""

# pyright: reportMissingImports=false
from benchmarks.comparison.workers.mjlab.hand import make_env, make_runner, versions
from benchmarks.comparison.workers.mjlab.watched import Seen, Watched
from benchmarks.comparison.workers.ppo_settings import SETTINGS
from benchmarks.comparison.workers.report import arguments
from benchmarks.comparison.workers.walking import (
    COMMAND_MPS,
    ITERATIONS,
    LAYERS,
    Walking,
)


def main() -> None:
    """Trains until the time is over, and says how fast the hand walks."""
    args = arguments()
    device = "cpu" if args.device == "cpu" else "cuda:0"
    note = f"same hand, {COMMAND_MPS} m/s forward, MuJoCo Warp"
    walking = Walking(args.seconds, versions(), note)

    def look(seen: Seen) -> None:
        walking.over(SETTINGS["unroll"], seen.speed_mps, seen.falls)

    made = make_env(args.mjcf, args.worlds, device, args.seed, walks=True)
    runner = make_runner(Watched(made.env, look), args.out, args.seed, LAYERS)
    runner.learn(num_learning_iterations=ITERATIONS, init_at_random_ep_len=True)


if __name__ == "__main__":
    main()
