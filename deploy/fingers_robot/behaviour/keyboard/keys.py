"""Playing a list of keys: one request at a time, decided by the first key event.

    idle gap ──► request ──► first key event or time-out ──► idle gap ──► next request

Key events come from whoever reads the keyboard; the policy never sees them.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingers_deploy.errors import InputError

ARROWS = ("left", "down", "right", "up")
"""Keys that can be asked for, in the order of the policy's one-hot request."""


@dataclass(frozen=True, slots=True)
class KeyTimes:
    """When keys are asked for.

    Attributes:
        idle_s: gap before each request [s].
        timeout_s: a request without a key event for so long has failed [s].
        retries: how often a key is asked for again after a time-out. A wrong key is
            never asked for again: it has had its effect.
    """

    idle_s: float = 0.5
    timeout_s: float = 1.5
    retries: int = 0


@dataclass(frozen=True, slots=True)
class KeyOutcome:
    """How one request ended.

    Attributes:
        asked: the requested key.
        pressed: the key that decided it; empty after a time-out.
        latency_s: from the request to its end [s].
    """

    asked: str
    pressed: str
    latency_s: float

    @property
    def correct(self) -> bool:
        """The requested key was the first."""
        return self.pressed == self.asked


@dataclass(frozen=True, slots=True)
class KeyState:
    """Where the list has come to.

    Attributes:
        keys: what remains to be asked for, the next one first.
        asking: a request is under way; else a gap.
        since_s: when request or gap began [s].
        tries: requests of the next key that have timed out.
        outcomes: of all requests so far.
    """

    keys: tuple[str, ...]
    asking: bool
    since_s: float
    tries: int = 0
    outcomes: tuple[KeyOutcome, ...] = ()

    @property
    def done(self) -> bool:
        """Every key has been decided."""
        return not self.keys

    @property
    def request(self) -> NDArray[np.float32]:
        """The policy's input: 1 at the requested key, zeros in a gap, [4]."""
        asked = self.keys[0] if self.asking and self.keys else ""
        return np.array([name == asked for name in ARROWS], np.float32)


def begin_keys(keys: Sequence[str], t: float) -> KeyState:
    """Begins a list with a gap.

    Args:
        keys: names out of `ARROWS`.
        t: monotonic time [s].

    Raises:
        InputError: a key that cannot be asked for.
    """
    for number, name in enumerate(keys):
        if name not in ARROWS:
            raise InputError("keys", str(number), name, f"one of {', '.join(ARROWS)}")
    return KeyState(tuple(keys), asking=False, since_s=t)


def keys_step(
    state: KeyState, pressed: Sequence[str], t: float, times: KeyTimes
) -> KeyState:
    """Moves on with the key events since the last step.

    Args:
        state: state after the step before.
        pressed: names of the keys that went down, first one first.
        t: monotonic time [s].
        times: gap and time-out.
    """
    if state.done:
        return state
    waited_s = t - state.since_s
    if not state.asking:
        begins = waited_s >= times.idle_s - 1e-9
        return _after(state, asking=True, t=t) if begins else state
    if pressed:
        return _decided(state, pressed[0], t, again=False)
    if waited_s >= times.timeout_s - 1e-9:
        return _decided(state, "", t, again=state.tries < times.retries)
    return state


def _decided(state: KeyState, pressed: str, t: float, again: bool) -> KeyState:
    outcome = KeyOutcome(state.keys[0], pressed, t - state.since_s)
    remaining = state.keys if again else state.keys[1:]
    tries = state.tries + 1 if again else 0
    return KeyState(remaining, False, t, tries, (*state.outcomes, outcome))


def _after(state: KeyState, asking: bool, t: float) -> KeyState:
    return KeyState(state.keys, asking, t, state.tries, state.outcomes)
