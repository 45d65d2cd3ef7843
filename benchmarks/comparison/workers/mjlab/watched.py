"""Worlds of mjlab that are looked at once in an iteration."""

# pyright: reportMissingImports=false
from collections.abc import Callable
from dataclasses import dataclass

import torch
from mjlab.rl import RslRlVecEnvWrapper

from benchmarks.comparison.workers.mjlab.hand import SPEED
from benchmarks.comparison.workers.ppo_settings import SETTINGS


@dataclass(frozen=True)
class Seen:
    """What one iteration showed.

    Attributes:
        length: mean of the latest iteration with ended episodes [control steps].
        speed_mps: along the command, of all worlds and steps; 0 where none is given.
        falls: of all worlds together, by the number of worlds.
    """

    length: float
    speed_mps: float
    falls: float


class Watched(RslRlVecEnvWrapper):
    """Worlds that are looked at once in an iteration.

    Args:
        env: of mjlab.
        look: is given what was seen.
    """

    def __init__(self, env, look: Callable[[Seen], object]):
        super().__init__(env)
        self._look, self._steps, self._length = look, 0, 0.0
        self._ages = torch.zeros(self.num_envs, device=self.device)
        self._sums = torch.zeros(4, device=self.device)

    def step(self, actions: torch.Tensor):
        """Steps; counts ended episodes, their steps, falls, and the speed of all."""
        found = super().step(actions)
        done = found[2].float()
        self._ages += 1.0
        ended = (done.sum(), (done * self._ages).sum())
        fell = self.unwrapped.termination_manager.terminated.float().sum()
        # As it was before ended episodes began anew, as the reward is.
        speed = found[3].get(SPEED, self._ages.new_zeros(1)).mean()
        self._sums += torch.stack([*ended, fell, speed])
        self._ages *= 1.0 - done
        self._steps += 1
        if self._steps % SETTINGS["unroll"] == 0:
            self._show()
        return found

    def _show(self) -> None:
        number, steps, fell, speed = self._sums.tolist()
        self._sums.zero_()
        if number:
            self._length = steps / number
        mean_mps = speed / SETTINGS["unroll"]
        self._look(Seen(self._length, mean_mps, fell / self.num_envs))
