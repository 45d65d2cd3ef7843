"""mjlab's training with a save and a load in its middle, and its exported policy."""

# pyright: reportMissingImports=false
from importlib.metadata import version
from pathlib import Path

import numpy as np
import onnxruntime
import torch

from benchmarks.comparison.workers.mjlab.hand import make_env, make_runner
from benchmarks.comparison.workers.report import (
    DIFFERENCE,
    EXPORT,
    arguments,
    largest,
    say,
)

HALF, OBSERVATIONS = 2, 4096


def main() -> None:
    """Trains whole and in halves, compares, exports, compares."""
    args = arguments()
    device = "cpu" if args.device == "cpu" else "cuda:0"
    about = f"mjlab {version('mjlab')}, rsl-rl-lib {version('rsl-rl-lib')}"
    shared = {"peer": "mjlab, RSL-RL PPO", "version": about, "unit": "1"}

    def runner(name: str):
        env = make_env(args.mjcf, args.worlds, device, args.seed)
        return make_runner(env, args.out / name, args.seed)

    def after(made, iterations: int) -> list[np.ndarray]:
        made.learn(num_learning_iterations=iterations)
        return [x.detach().cpu().numpy() for x in made.alg.get_policy().parameters()]

    whole = runner("whole")
    ends = after(whole, 2 * HALF)
    again = after(runner("again"), 2 * HALF)
    first = runner("halves")
    first.learn(num_learning_iterations=HALF)
    saved = str(args.out / "half.pt")
    first.save(saved)
    second = runner("rest")
    second.load(saved)
    note = f"its save and load after {HALF} of {2 * HALF} iterations; the same seed"
    note += f" twice without: {largest(ends, again):.2g}"
    apart = largest(ends, after(second, HALF))
    say(quantity=DIFFERENCE, value=apart, note=note, **shared)
    note = f"its ONNX exporter, {OBSERVATIONS} random observations"
    say(quantity=EXPORT, value=_parity(whole, args.out), note=note, **shared)
    say(done=True)


def _parity(runner, folder: Path) -> float:
    """Returns the largest difference of an action, policy in Torch and exported."""
    runner.export_policy_to_onnx(str(folder))
    session = onnxruntime.InferenceSession(str(folder / "policy.onnx"))
    (given,) = session.get_inputs()
    shape = (OBSERVATIONS, 1, given.shape[-1])
    seen = np.random.default_rng(0).standard_normal(shape).astype(np.float32)
    graph = runner.alg.get_policy().as_onnx(verbose=False).to("cpu").eval()
    with torch.no_grad():
        wanted = [graph(torch.from_numpy(row)).numpy() for row in seen]
    found = [session.run(None, {given.name: row})[0] for row in seen]
    return largest(wanted, found)


if __name__ == "__main__":
    main()
