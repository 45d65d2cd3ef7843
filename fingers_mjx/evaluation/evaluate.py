"""Evaluation: many randomized episodes of one policy, measured one by one."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial

import jax
import numpy as np
from jax.tree_util import Partial
from jaxtyping import Array, Float, PRNGKeyArray

from envs.base import State, VectorEnv
from envs.errors import InputError
from fingers_mjx.evaluation.draws import world_columns
from fingers_mjx.evaluation.measures import steps_alive
from fingers_mjx.evaluation.record import MASS_KG, Trace, episode_measures, record

REPORT_EVERY = 50
Policy = Callable[[dict[str, Array]], Float[Array, "B actions"]]
Progress = Callable[[int, int], None]
TaskMeasures = Callable[[Mapping[str, Array], Array], dict[str, Array]]


@dataclass(frozen=True)
class EpisodeTable:
    """Measures and traces of an evaluation.

    Attributes:
        columns: name of a measure to one value per episode; NaN means undefined.
        traces: NumPy arrays, axes time and episode first.
        dt_s: control interval.
        worlds: what the randomization of the hand drew for the world of each episode
            (`draws.world_columns`).
    """

    columns: dict[str, np.ndarray]
    traces: Trace
    dt_s: float
    worlds: dict[str, np.ndarray] = field(default_factory=dict)

    def episode(self, index: int) -> Trace:
        """Returns the steps of one episode that count, time first."""
        one = jax.tree.map(lambda x: x[:, index], self.traces)
        length = int(steps_alive(one.done, one.failed).sum())
        return jax.tree.map(lambda x: x[:length], one)


@dataclass(frozen=True)
class Episodes:
    """Which episodes are run.

    Attributes:
        number: of episodes.
        steps: longest episode in control steps.
        key: of the resets; the same key gives the same episodes.

    Raises:
        InputError: `number` or `steps` is below one.
    """

    number: int
    steps: int
    key: PRNGKeyArray

    def __post_init__(self) -> None:
        for name, value in (("episodes", self.number), ("steps", self.steps)):
            if value < 1:
                raise InputError("evaluate", name, value, "an integer above 0")


@dataclass(frozen=True)
class Measuring:
    """What the measures of an episode need besides its trace.

    Attributes:
        mass_kg: of the hand and what it carries, for the cost of transport.
        task_measures: of one episode, from the fields of its trace by name and the
            steps that count; added to those that every task has.
    """

    mass_kg: float = MASS_KG
    task_measures: TaskMeasures | None = None


PAPER = Measuring()
"""The paper's measures for the paper's hand."""


def evaluate(
    env: VectorEnv,
    policy: Policy,
    episodes: Episodes,
    measuring: Measuring = PAPER,
    progress: Progress | None = None,
) -> EpisodeTable:
    """Runs a policy and measures each episode up to its first `done`.

    Batches are run until there are enough episodes; what a world does after its first
    `done` is ignored, so it does not matter whether the environment resets itself, as
    long as the signals of that step are its own (`envs.batch.BatchEnv` keeps them). An
    episode that is still running after the last step counts as survived.

    Args:
        env: the environment; the batch is as large as its `reset` makes it.
        policy: from batched observations to batched actions, deterministic; what a
            `jax.tree_util.Partial` binds is no constant of the compiled program.
        episodes: which ones.
        measuring: what is measured.
        progress: called with (steps done, steps in all) from time to time.
    """
    traces, worlds = run_episodes(env, policy, episodes, progress)
    return episode_table(traces, float(env.dt), measuring, worlds)


def run_episodes(
    env: VectorEnv,
    policy: Policy,
    episodes: Episodes,
    progress: Progress | None = None,
) -> tuple[Trace, dict[str, np.ndarray]]:
    """Returns traces and worlds of as many episodes, for `episode_table`.

    Args:
        env: as in `evaluate`, as the rest.
        policy: from batched observations to batched actions.
        episodes: which ones.
        progress: called with (steps done, steps in all) from time to time.

    Returns:
        NumPy arrays: of the traces axes time and episode first, and what was drawn for
        the world of each episode.

    Source:
        Ours.
    """
    number, steps = episodes.number, episodes.steps
    stretch = min(REPORT_EVERY, steps)
    # In one program: on a GPU single steps would wait for their launch, each anew.
    advance = jax.jit(partial(_advance, env, stretch))
    rollouts, drawn, reset, policy = [], [], jax.jit(env.reset), Partial(policy)
    while (count := sum(r.done.shape[1] for r in rollouts)) < number:
        state = reset(jax.random.fold_in(episodes.key, len(rollouts)))
        worlds = len(state.done)
        drawn.append(world_columns(state))
        report = _reporting(
            progress, count // worlds * steps, -(-number // worlds) * steps
        )
        rollouts.append(_rollout(partial(advance, policy), state, steps, report))
    traces = jax.tree.map(lambda *x: np.concatenate(x, 1)[:, :number], *rollouts)
    return traces, jax.tree.map(lambda *x: np.concatenate(x)[:number], *drawn)


def episode_table(
    traces: Trace,
    dt_s: float,
    measuring: Measuring,
    worlds: dict[str, np.ndarray] | None = None,
) -> EpisodeTable:
    """Measures recorded episodes.

    Args:
        traces: NumPy arrays, axes time and episode first.
        dt_s: control interval.
        measuring: what is measured.
        worlds: what was drawn for the world of each episode, if it is known.
    """
    found = _measures(traces, dt_s, measuring.mass_kg)
    if measuring.task_measures is not None:
        own = partial(_task_measures, measuring.task_measures)
        found = found | jax.vmap(own, 1)(traces)
    columns = {name: np.asarray(values, float) for name, values in found.items()}
    return EpisodeTable(columns, traces, dt_s, worlds or {})


def _task_measures(measure: TaskMeasures, trace: Trace) -> dict[str, Array]:
    return measure(vars(trace) | trace.extra, steps_alive(trace.done, trace.failed))


def _advance(
    env: VectorEnv, steps: int, policy: Policy, state: State
) -> tuple[State, Trace]:
    """Returns the state after a stretch of so many steps, and their trace."""

    def one(state: State, _: None) -> tuple[State, Trace]:
        after = env.step(state, policy(state.obs))
        return after, record(after)

    return jax.lax.scan(one, state, length=steps)


def _rollout(
    advance: Callable[[State], tuple[State, Trace]],
    state: State,
    steps: int,
    report: Callable[[int], None],
) -> Trace:
    """Returns the trace of `steps` steps; the last stretch may be longer."""
    taken, done = [], 0
    while done < steps:
        state, stretch = advance(state)
        taken.append(jax.device_get(stretch))
        done += len(taken[-1].done)
        report(min(done, steps))
    return jax.tree.map(lambda *x: np.concatenate(x)[:steps], *taken)


def _reporting(progress: Progress | None, before: int, total: int):
    def report(done: int) -> None:
        if progress is not None:
            progress(before + done, total)

    return report


@partial(jax.jit, static_argnames=("dt_s", "mass_kg"))
def _measures(traces: Trace, dt_s: float, mass_kg: float) -> dict[str, Array]:
    measure = partial(episode_measures, dt_s=dt_s, mass_kg=mass_kg)
    return jax.vmap(measure, in_axes=1)(traces)
