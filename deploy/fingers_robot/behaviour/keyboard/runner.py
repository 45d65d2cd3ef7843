"""Requests for keys: a list, and what the operator adds to it while it is played."""

import dataclasses

import numpy as np
from numpy.typing import NDArray

from fingers_robot.behaviour.keyboard.events import KeySource
from fingers_robot.behaviour.keyboard.keys import (
    ARROWS,
    KeyTimes,
    begin_keys,
    keys_step,
)

MOST_KEYS = 1000
"""That may wait at a time."""


class KeyRunner:
    """Plays a list of keys while a policy that presses them runs.

    Args:
        keys: names out of `ARROWS`, to begin with.
        source: of key events; without one every request ends by its time-out.
        times: gap and time-out.

    Raises:
        InputError: a key that cannot be asked for.
    """

    def __init__(
        self,
        keys: tuple[str, ...] = (),
        source: KeySource | None = None,
        times: KeyTimes | None = None,
    ):
        self._source, self._times = source, times or KeyTimes()
        self._state, self._going = begin_keys(keys, 0.0), False

    def ask(self, key: int) -> None:
        """Adds a key, by its place in `ARROWS`, to a list that has room for it."""
        if 0 <= key < len(ARROWS) and len(self._state.keys) < MOST_KEYS:
            keys = (*self._state.keys, ARROWS[key])
            self._state = dataclasses.replace(self._state, keys=keys)

    def step(self, t: float, may_ask: bool) -> NDArray[np.float32]:
        """Returns the request of this control step, [4].

        Args:
            t: monotonic time [s].
            may_ask: the policy runs and the operator lets it; else nothing is asked
                for, and a request that was under way is asked for again later.
        """
        pressed = () if self._source is None else self._source.poll()
        going = may_ask and not self._state.done
        if going and self._going:
            self._state = keys_step(self._state, pressed, t, self._times)
        else:
            self._state = dataclasses.replace(self._state, asking=False, since_s=t)
        self._going = going
        return self._state.request

    @property
    def lost(self) -> bool:
        """Whether the keyboard has gone."""
        return self._source is not None and self._source.lost

    def story(self) -> str:
        """One sentence on what came of the requests; empty if there were none."""
        outcomes = self._state.outcomes
        if not outcomes:
            return ""
        if self._source is None:
            return f"keys: {len(outcomes)} asked for; no --keyboard reported which came"
        hits = [outcome.latency_s for outcome in outcomes if outcome.correct]
        median = f", median latency {np.median(hits):.2f} s" if hits else ""
        return f"keys: {len(hits)} of {len(outcomes)} correct{median}"
