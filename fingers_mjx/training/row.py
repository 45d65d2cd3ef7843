"""One row of the learning curve, from metrics gathered on the device.

    iteration, iterations   done and in all
    env_steps               control steps of all worlds, since the start of the run
    elapsed_s, time_s       training time over all starts; seconds since 1970
    steps_per_s, eta_s      since the last start, once the first call has compiled
    episode/return          mean return of the episodes that ended
    episode/length          mean length of the episodes that ended [control steps]
    episode/ended, failed   number of episodes that ended; of those, by a failure
    reward/<term>           mean per control step, weighted and times the interval
    <any other metric>      of the environment, mean per control step
    …_overflow_worlds       worlds in which Warp dropped something, see
                            `envs.physics.room`
    loss/…, kl, grad_norm   means over the updates that were applied
    learning_rate           mean over the updates
    policy/std, entropy     of the action noise [nat]
    invalid                 steps that were set aside as not finite
    updates_skipped         updates skipped as not finite, since the start of the run

A metric without any sample, such as the return before an episode has ended, is
omitted. Other counts are per iteration.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from jaxtyping import Float

from fingers_mjx.ppo.config import TrainConfig


@dataclass
class Window:
    """Metrics of the iterations since the last row.

    Attributes:
        sums: sum and weight of each member's metrics, per call; on the device.
        timed_s: time of the calls in which nothing was compiled [s].
        timed_iterations: iterations of those calls.
    """

    sums: list[Any] = field(default_factory=list)
    timed_s: float = 0.0
    timed_iterations: int = 0

    def time(self, elapsed_s: float, iterations: int) -> None:
        """Adds the time of one call in which nothing was compiled."""
        self.timed_s += elapsed_s
        self.timed_iterations += iterations

    def total(self) -> Float[np.ndarray, "s k 2"]:
        """Fetches (Σ w x, Σ w) [its unit, 1] of each metric of each member.

        Source:
            Ours, see `fingers_mjx.ppo.totals.total`.
        """
        return np.sum([np.asarray(s) for s in self.sums], 0)


def speed(window: Window, config: TrainConfig, iteration: int) -> dict[str, float]:
    """Returns steps per second and the remaining time; nothing before a timed call."""
    if not window.timed_iterations:
        return {}
    iteration_s = window.timed_s / window.timed_iterations
    return {
        "steps_per_s": config.steps_per_iteration / iteration_s,
        "eta_s": iteration_s * (config.iterations - iteration),
    }
