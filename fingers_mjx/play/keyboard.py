"""Lists of keys in the closed loop: the shim asks, the simulated keyboard answers."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import accumulate
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from envs.base import State
from envs.batch import BatchEnv
from envs.memory import Memory
from envs.observations import Sample
from envs.tasks.keyboard.model import KEY_NAMES
from envs.tasks.keyboard.requests import IDLE
from fingers_deploy import Bundle
from fingers_deploy.policy import Runtime
from fingers_mjx.evaluation.record import Trace
from fingers_mjx.play.player import Played, Player, Schedule
from fingers_mjx.play.sokoban import Board, move
from fingers_robot.behaviour.keyboard.fingertip import pressing_fingertip
from fingers_robot.behaviour.keyboard.keys import (
    ARROWS,
    KeyOutcome,
    KeyState,
    KeyTimes,
    begin_keys,
    keys_step,
)


@dataclass(frozen=True)
class KeysPlayed:
    """What came of a list of keys in one episode.

    Attributes:
        outcomes: of all requests, in order.
        pressed: every key that went down, asked for or not, in order.
        complete: every key of the list was decided.
    """

    outcomes: tuple[KeyOutcome, ...]
    pressed: tuple[str, ...]
    complete: bool

    def board(self, start: Board) -> Board:
        """Returns where the keys that went down lead on a board."""
        return reduce(move, self.pressed, start)


class KeyPlayer(Player):
    """Plays a list of keys through the shim.

    The shim asks for one key after another and works out the fingertip from the
    encoders; key events come from the simulated keyboard.

    Args:
        env: worlds of the keyboard task.
        bundle: the keyboard policy.
        keys: what to ask for, names out of `ARROWS`.
        times: gap, time-out and retries.
        runtime: what runs the policy.

    Raises:
        BundleError: the joints of the bundle are not those of the hand.
        InputError: a key that cannot be asked for.
    """

    def __init__(
        self,
        env: BatchEnv,
        bundle: Bundle,
        keys: Sequence[str],
        times: KeyTimes | None = None,
        runtime: Runtime = "auto",
    ):
        super().__init__(env, bundle, runtime)
        self.keys, self.times = tuple(keys), times or KeyTimes()
        self.results: list[KeysPlayed] = []
        self._state = begin_keys(self.keys, 0.0)
        self._pressed: tuple[str, ...] = ()
        reset, judge = self._reset, self._judge
        self._reset: Any = lambda key: self._begun(reset(key))
        self._judge: Any = lambda *step: self._noted(*judge(*step))

    def play(self, key: Array, steps: int, schedule: Schedule | None = None) -> Played:
        """Plays the list in one world; see `Player.play`."""
        played = super().play(key, steps, schedule)
        state = self._state
        self.results.append(KeysPlayed(state.outcomes, self._pressed, state.done))
        return played

    def take_over(self, other: Player) -> None:
        """Goes on with the shim and the list of another player of keys."""
        super().take_over(other)
        assert isinstance(other, KeyPlayer)
        self._state, self._pressed = other._state, other._pressed

    def _begun(self, start: State) -> State:
        """Begins the list with an episode."""
        self._state, self._pressed = begin_keys(self.keys, 0.0), ()
        return dataclasses.replace(start, memory=_asking(start.memory, self._state))

    def _noted(self, memory: Memory, row: Trace) -> tuple[Memory, Trace]:
        """Passes what was pressed to the robot, and what it asks for to the task."""
        pressed = pressed_in(row)
        self._pressed += pressed
        time_s = float(memory.steps) * self.env.dt
        since_s = self._state.since_s
        self._state = keys_step(self._state, pressed, time_s, self.times)
        same = since_s == self._state.since_s
        waited = int(memory.task.requests.steps) if same else 0
        return _asking(memory, self._state, waited), row

    def _task_inputs(
        self, memory: Memory, sensed: Sample, joint_pos: Float[np.ndarray, " joints"]
    ) -> Float[np.ndarray, " inputs"]:
        v_quat_b = self.controller.bundle.manifest.interface.v_quat_b
        tip_v = pressing_fingertip(joint_pos, v_quat_b)
        return np.concatenate([self._state.request, tip_v])


def pressed_in(row: Trace) -> tuple[str, ...]:
    """Returns the names of the keys that went down in a step."""
    flags = np.asarray(row.extra["key_pressed"]) > 0
    return tuple(np.array(KEY_NAMES)[flags].tolist())


def boards_of(trace: Trace, start: Board) -> list[Board]:
    """Returns the board after every step of an episode."""
    flags = np.asarray(trace.extra["key_pressed"]) > 0
    steps = [[KEY_NAMES[i] for i in np.flatnonzero(row)] for row in flags]
    after = accumulate(
        steps, lambda board, names: reduce(move, names, board), initial=start
    )
    return list(after)[1:]


def keys_story(results: Sequence[KeysPlayed], start: Board | None) -> str:
    """Returns one sentence on what came of all episodes.

    Args:
        results: of the episodes.
        start: the board that was played, if any.
    """
    outcomes = [outcome for result in results for outcome in result.outcomes]
    hits = [outcome.latency_s for outcome in outcomes if outcome.correct]
    text = f"{len(hits)} of {len(outcomes)} keys correct"
    if hits:
        text += f", median latency {np.median(hits):.2f} s"
    if start is not None:
        solved = sum(result.board(start).solved for result in results)
        text += f"; level solved in {solved} of {len(results)}"
    return text


def _asking(memory: Memory, state: KeyState, waited: int = 0) -> Memory:
    """Enters what the shim asks for into what the environment keeps of the episode."""
    asked = state.asking and not state.done
    number = ARROWS.index(state.keys[0]) if asked else IDLE
    requests = dataclasses.replace(
        memory.task.requests,
        key=jnp.asarray(number, jnp.int32),
        steps=jnp.asarray(waited, jnp.int32),
        gap_steps=jnp.asarray(np.iinfo(np.int32).max, jnp.int32),
    )
    task = dataclasses.replace(memory.task, requests=requests)
    return dataclasses.replace(memory, task=task)
