"""What a turn on the spot earns beside standing still, by term of the reward.

python -m benchmarks.claims.turn_price POLICY --set env.weights.footprint=-240

Means over 32 randomized episodes of 6 s, without their first second, in C MuJoCo, with
as much noise on the actions as is said; in thousandths a control step, as they are
weighted at the end of the schedules. Who stands is the policy too, shown no command.
"""

import argparse
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from envs.base import State
from envs.batch import BatchEnv
from envs.errors import InputError
from envs.observations import HISTORY
from fingers_mjx.evaluation.setups import with_command
from fingers_mjx.policy.actor import Network, acting_together
from fingers_mjx.policy.source import PolicySource, load_source
from fingers_mjx.runs.settings import overridden
from fingers_mjx.runs.setup import make_env

COMMANDS = ((0.0, 0.0, 0.45), (0.0, 0.0, -0.45))
NOISE = (0.0, 0.3, 0.6)
WORLDS, STEPS, SETTLED = 32, 300, 50
COMMANDS_SEEN = 3 * HISTORY
"""Entries of the commands that are kept, at the end of what the policy sees."""
TRACKING = (
    "track_planar_velocity",
    "track_mean_planar_velocity",
    "track_yaw_rate",
    "track_mean_yaw_rate",
    "footprint",
)
GROWN = [f"env.schedule_scale.track_{name}_rate=0.001" for name in ("yaw", "mean_yaw")]
"""Settings with which the yaw rewards are what they become in training."""


@dataclass(frozen=True)
class Acting:
    """A policy, or the same shown that it should stand.

    Attributes:
        network: of the policy.
        noise: standard deviation of what is added to each action.
        stands: whether all commands that it sees are zero.
    """

    network: Network
    noise: float
    stands: bool

    def __call__(self, key: Array, obs: Mapping[str, Array]) -> Array:
        """Returns the actions of all worlds."""
        seen = obs["state"]
        seen = seen.at[:, -COMMANDS_SEEN:].set(0.0) if self.stands else seen
        action = acting_together([self.network])({"state": seen})
        return action + self.noise * jax.random.normal(key, action.shape)


def earned(batch: BatchEnv, acting: Acting, steps: int = STEPS) -> dict[str, float]:
    """Returns the mean of each term [1/1000 a control step], and their `total`."""

    def step(state: State, key: Array) -> tuple[State, dict[str, Float[Array, ""]]]:
        state = batch.step(state, acting(key, state.obs))
        return state, _terms(state)

    keys = jax.random.split(jax.random.key(1), steps)
    run = jax.jit(partial(jax.lax.scan, step))
    _, terms = run(batch.reset(jax.random.key(0)), keys)
    return {name: 1e3 * float(jnp.mean(x[SETTLED:])) for name, x in terms.items()}


def _terms(state: State) -> dict[str, Float[Array, ""]]:
    """Means over worlds."""
    terms = {k: v for k, v in state.metrics.items() if k.startswith("reward/")}
    named = {name.removeprefix("reward/"): jnp.mean(x) for name, x in terms.items()}
    return named | {"total": jnp.mean(state.reward)}


def rows(source: PolicySource, settings: Sequence[str]) -> list[str]:
    """Returns the rows of the table, in Markdown.

    Raises:
        InputError: a policy of another task, or settings that do not fit.
    """
    task = source.setup.train.task
    if task != "crawl":
        raise InputError("POLICY", "task", task, "crawl, the task with commands")
    setup = overridden(source.setup, [*settings, *GROWN])
    found = []
    for command in COMMANDS:
        batch = make_env(with_command(setup, command), WORLDS, "cpu", auto_reset=False)
        for who, stands in (("turns", False), ("stands", True)):
            for noise in NOISE:
                terms = earned(batch, Acting(source.network, noise, stands))
                found.append(_row(f"{command[2]:+.2f} | {who} | {noise}", terms))
    return found


def _row(start: str, terms: Mapping[str, float]) -> str:
    shown = [terms[name] for name in TRACKING]
    values = [*shown, terms["total"] - sum(shown), terms["total"]]
    return f"| {start} | {' | '.join(f'{x:.1f}' for x in values)} |"


def main(words: Sequence[str] | None = None) -> int:
    """Prints the table of the command line's policy."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("policy", type=Path, metavar="POLICY")
    parser.add_argument("--set", dest="settings", nargs="+", default=[])
    args = parser.parse_args(words)
    names = ["asked [rad/s]", "hand", "noise", *TRACKING, "rest", "total"]
    try:
        found = rows(load_source(args.policy), args.settings)
    except InputError as error:
        print(f"turn_price: {error}", file=sys.stderr)
        return 2
    lines = [f"| {' | '.join(names)} |", "|---" * len(names) + "|", *found]
    print(*lines, sep="\n")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
