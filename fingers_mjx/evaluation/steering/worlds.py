"""Worlds that are steered: by one command each, or by the heading controller."""

import dataclasses
from dataclasses import dataclass
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PRNGKeyArray

from envs.base import State
from envs.batch import BatchEnv
from envs.errors import InputError
from envs.tasks.push.guide import heading
from fingers_mjx.evaluation.evaluate import Episodes, EpisodeTable, Progress, evaluate
from fingers_mjx.evaluation.source import measuring
from fingers_mjx.evaluation.wrapped import Wrapped
from fingers_mjx.policy.actor import acting
from fingers_mjx.policy.source import PolicySource
from fingers_mjx.runs.setup import make_env
from fingers_robot.behaviour.heading import HeadingConfig, heading_step

BEGIN_S = 2.0
"""Time after which the hand counts as under way [s]."""


@dataclass(frozen=True)
class Course:
    """What is driven, and under which conditions.

    Attributes:
        episodes: of each command or step, each in a world of its own.
        seed: of worlds and noise.
        backend: physics backend.
        seconds: length of an episode [s].

    Raises:
        InputError: an episode that is too short.
    """

    episodes: int
    seed: int = 0
    backend: str = "cpu"
    seconds: float = 10.0

    def __post_init__(self) -> None:
        if self.seconds < 2 * BEGIN_S:
            found, valid = f"{self.seconds:g}", f"{2 * BEGIN_S:g} or more"
            raise InputError("--seconds", "", found, valid)


@dataclass(frozen=True)
class Commanded(Wrapped):
    """Worlds that each keep one command; the policy sees it from the second step on.

    Attributes:
        commands: of the worlds.
    """

    commands: Float[np.ndarray, "b 3"]

    def reset(self, key: PRNGKeyArray) -> State:
        """Starts an episode in every world, under its command."""
        state = self.env.reset(key)
        return _with_memory(state, command=jnp.asarray(self.commands, jnp.float32))


@dataclass(frozen=True)
class Holding(Commanded):
    """Worlds whose yaw rate the robot's heading controller commands.

    What it holds is the heading at the start plus a step. A world carries it in the
    field `task` of its memory, which a task of commands leaves empty.

    Attributes:
        steps_rad: of the worlds.
        gains: of the controller.
    """

    steps_rad: Float[np.ndarray, " b"]
    gains: HeadingConfig

    def reset(self, key: PRNGKeyArray) -> State:
        """Starts an episode in every world, and takes its heading."""
        state = super().reset(key)
        held = self._heading(state) + jnp.asarray(self.steps_rad, jnp.float32)
        return _with_memory(state, task=held)

    def step(self, state: State, action: Float[Array, "b a"]) -> State:
        """Advances every world, then asks the controller for the next command."""
        state = super().step(state, action)
        heading, held = self._heading(state), state.memory.task
        shape = jax.ShapeDtypeStruct(heading.shape, heading.dtype)
        rate = jax.pure_callback(partial(_rates, self.gains), shape, held, heading)
        return _with_memory(state, command=state.memory.command.at[:, 2].set(rate))

    def _heading(self, state: State) -> Float[Array, " b"]:
        """Returns the heading of V of every world [rad]."""
        q_off = jnp.asarray(self.env.stance.q_off)
        return jax.vmap(lambda q: heading(q, q_off))(state.signals.palm_quat_w)


def worlds_of(source: PolicySource, course: Course, kinds: int) -> BatchEnv:
    """Returns the worlds of the policy's task, whose commands do not change.

    Args:
        source: policy; its setup is what is simulated.
        course: what is driven.
        kinds: how many commands or steps there are.

    Raises:
        InputError: a task without commands.
    """
    setup = source.setup
    if not hasattr(setup.env, "command"):
        valid = "a task whose policy follows commands"
        raise InputError(source.path, "task", setup.train.task, valid)
    command = dataclasses.replace(setup.env.command, resample_s=2 * course.seconds)
    env = dataclasses.replace(setup.env, command=command, episode_s=course.seconds)
    setup = dataclasses.replace(setup, env=env)
    return make_env(setup, kinds * course.episodes, course.backend, auto_reset=False)


def driven(
    worlds: Commanded,
    source: PolicySource,
    course: Course,
    progress: Progress | None = None,
) -> EpisodeTable:
    """Runs the policy in steered worlds, an episode in each."""
    steps, key = round(course.seconds / worlds.dt), jax.random.key(course.seed)
    wanted = Episodes(worlds.num_envs, steps, key)
    policy = acting(source.network)
    return evaluate(worlds, policy, wanted, measuring(worlds.env), progress)


def _with_memory(state: State, **fields: Any) -> State:
    memory = dataclasses.replace(state.memory, **fields)
    return dataclasses.replace(state, memory=memory)


def _rates(gains: HeadingConfig, held: Array, heading: Array) -> np.ndarray:
    """Returns what the controller commands in each world [rad/s]."""
    pairs = zip(np.asarray(held).tolist(), np.asarray(heading).tolist(), strict=True)
    rates = [heading_step(one, now, 0.0, gains)[1] for one, now in pairs]
    return np.array(rates, np.float32)
