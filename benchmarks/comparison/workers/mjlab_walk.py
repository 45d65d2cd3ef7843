"""RSL-RL's PPO on the hand of mjlab, paid for walking, for a given time."""

# pyright: reportMissingImports=false
from importlib.metadata import version
from typing import Protocol

import torch
from mjlab.rl import RslRlVecEnvWrapper

from benchmarks.comparison.workers.mjlab_hand import make_env, make_runner, velocity
from benchmarks.comparison.workers.ppo_settings import SETTINGS
from benchmarks.comparison.workers.report import arguments
from benchmarks.comparison.workers.walking import COMMAND_MPS, ITERATIONS, Walking


class Watcher(Protocol):
    """What looks at a training once in an iteration."""

    def over(self, length: float, speed_mps: float) -> bool:
        """Takes the mean length of ended episodes [control steps] and the speed."""
        ...


class Watched(RslRlVecEnvWrapper):
    """Worlds whose episodes and speed are looked at once in an iteration.

    Args:
        env: of mjlab.
        watcher: is given the means.
    """

    def __init__(self, env, watcher: Watcher):
        super().__init__(env)
        self._watcher, self._steps = watcher, 0
        self._ages = torch.zeros(self.num_envs, device=self.device)
        self._sums = torch.zeros(3, device=self.device)
        self._length = 0.0

    def step(self, actions: torch.Tensor):
        """Steps; counts ended episodes, their steps, and the speed of all worlds."""
        found = super().step(actions)
        done = found[2].float()
        self._ages += 1.0
        ended = (done.sum(), (done * self._ages).sum())
        self._sums += torch.stack([*ended, velocity(self.env)[0].mean()])
        self._ages *= 1.0 - done
        self._steps += 1
        if self._steps % SETTINGS["unroll"] == 0:
            self._look()
        return found

    def _look(self) -> None:
        number, steps, speed = self._sums.tolist()
        self._sums.zero_()
        if number:
            self._length = steps / number
        self._watcher.over(self._length, speed / SETTINGS["unroll"])


def main() -> None:
    """Trains until the time is over, and says how fast the hand walks."""
    args = arguments()
    device = "cpu" if args.device == "cpu" else "cuda:0"
    about = f"mjlab {version('mjlab')}, rsl-rl-lib {version('rsl-rl-lib')}"
    about += f", warp {version('warp-lang')}, torch {version('torch')}"
    note = f"same hand, {COMMAND_MPS} m/s forward, MuJoCo Warp"
    made = make_env(args.mjcf, args.worlds, device, args.seed, walks=True)
    env = Watched(made.env, Walking(args.seconds, about, note))
    runner = make_runner(env, args.out, args.seed)
    runner.learn(num_learning_iterations=ITERATIONS)


if __name__ == "__main__":
    main()
