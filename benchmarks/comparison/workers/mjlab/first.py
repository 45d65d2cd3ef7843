"""mjlab's first iteration of RSL-RL's PPO on the same hand."""

# pyright: reportMissingImports=false
from benchmarks.comparison.workers.mjlab.hand import make_env, make_runner, versions
from benchmarks.comparison.workers.report import arguments, say


def main() -> None:
    """Trains one iteration and says so."""
    args = arguments()
    device = "cpu" if args.device == "cpu" else "cuda:0"
    env = make_env(args.mjcf, args.worlds, device, args.seed)
    make_runner(env, args.out, args.seed).learn(num_learning_iterations=1)
    say(first=True, version=versions(), note="same hand standing, MuJoCo Warp")


if __name__ == "__main__":
    main()
