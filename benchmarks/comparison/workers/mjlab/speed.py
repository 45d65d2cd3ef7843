"""mjlab's environment of the hand, with small random actions."""

# pyright: reportMissingImports=false
from importlib.metadata import version

import torch

from benchmarks.comparison.workers.mjlab.hand import make_env
from benchmarks.comparison.workers.report import STEPS_PER_CALL, arguments, serve


def main() -> None:
    """Builds the worlds and answers the command."""
    args = arguments()
    device = "cpu" if args.device == "cpu" else "cuda:0"
    env = make_env(args.mjcf, args.worlds, device, args.seed)
    repeat = STEPS_PER_CALL[args.device]

    def call() -> int:
        with torch.inference_mode():
            for _ in range(repeat):
                env.step(0.3 * torch.randn(args.worlds, env.num_actions, device=device))
        if device != "cpu":
            torch.cuda.synchronize()
        return repeat * args.worlds

    about = f"mjlab {version('mjlab')}, mujoco-warp {version('mujoco-warp')}"
    about += f", warp {version('warp-lang')}, torch {version('torch')}"
    serve(call, version=about, note="same hand standing, MuJoCo Warp")


if __name__ == "__main__":
    main()
