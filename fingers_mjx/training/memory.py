"""Whether what a run needs fits into this machine, estimated before anything is made.

The estimate is a lower bound: parameters with their gradient and the two moments of
Adam, and the data of one iteration twice, as they are collected and as they are
shuffled. Physics, activations and the compiler come on top; so what is refused cannot
run.
"""

import itertools
import os
from collections.abc import Sequence
from pathlib import Path

from envs.errors import InputError
from fingers_mjx.ppo.config import TrainConfig

INPUTS, ACTIONS = 392, 20
"""Of the crawl policy; the other tasks have about as many."""
_FLOAT = 4  # bytes
_COPIES = 4  # parameters, gradient, two moments
_GPU_BYTES = 1 << 40
"""More than any GPU has; it is not asked before JAX is there."""
_GPU = Path("/proc/driver/nvidia/version")
_GROUP = Path("/sys/fs/cgroup/memory.max")


def needed_bytes(config: TrainConfig, learners: int = 1) -> int:
    """Least memory of a training run [bytes].

    Args:
        config: its settings.
        learners: learners of a population.
    """
    ppo = config.ppo
    parameters = _parameters((INPUTS, *ppo.actor_layers, 2 * ACTIONS))
    parameters += _parameters((INPUTS, *ppo.critic_layers, 1))
    row = INPUTS + 2 * ACTIONS
    data = 2 * config.num_envs * ppo.unroll_length * row
    return learners * _FLOAT * (_COPIES * parameters + data)


def machine_bytes() -> int:
    """Memory that a run may have here: of the machine or its group, or of a GPU."""
    if _GPU.exists():
        return _GPU_BYTES
    total = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    try:
        text = _GROUP.read_text("ascii").strip()
    except (OSError, ValueError):
        return total
    return min(total, int(text)) if text.isdigit() else total


def check_memory(
    config: TrainConfig, learners: int = 1, source: str = "settings"
) -> None:
    """Refuses a run that needs more memory than there is.

    Args:
        config: its settings.
        learners: learners of a population.
        source: where the settings are from, which the error names.

    Raises:
        InputError: with the number.
    """
    needed, there = needed_bytes(config, learners), machine_bytes()
    if needed > there:
        found = f"at least {_gigabytes(needed)} of memory needed"
        valid = (
            f"{_gigabytes(there)} here: fewer worlds, shorter unrolls, smaller layers"
        )
        raise InputError(source, "num_envs, ppo", found, valid)


def _parameters(sizes: Sequence[int]) -> int:
    """Weights and biases of dense layers of these sizes."""
    return sum(fan_in * size + size for fan_in, size in itertools.pairwise(sizes))


def _gigabytes(count: int) -> str:
    return f"{count / 1e9:,.1f} GB"
