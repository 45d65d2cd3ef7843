"""Messages between the console and the supervisor's process."""

import json
import math
import socket
from collections import deque
from typing import Any

from fingers_robot.behaviour.heading import turn_of
from fingers_robot.behaviour.keyboard.keys import ARROWS
from fingers_robot.safety.types import Operator
from fingers_robot.waiting import waiting

_LONGEST = 65536
_AT_ONCE = 64  # words that one step of the loop takes
_MAX_KEYS = 64
ALIVE = "alive"
ALIVE_S = 0.1
"""How often the console shows that it is there."""
SILENCE_S = 2.0
"""A console that was there and shows nothing for so long [s] is gone, as one that is
stopped or that waits for ever. Not shorter: it has no right to the processor."""
ACTIONS = {
    "arm": Operator.ARM,
    "stop": Operator.STOP,
    "off": Operator.OFF,
    "clear": Operator.CLEAR,
}
_URGENCY = (Operator.STOP, Operator.OFF)


class ConsoleLink:
    """The supervisor's end: actions in, status out; never blocks.

    Args:
        end: the socket.
        policies: how many policies there are to select.
    """

    def __init__(self, end: socket.socket, policies: int = 1):
        self._socket, self._policies = end, policies
        end.setblocking(False)
        self.quitting = False
        self.selected: int | None = None
        self.keys: deque[int] = deque(maxlen=_MAX_KEYS)
        self.turned_rad = 0.0
        self._last_s = math.inf

    def poll(self, t: float) -> Operator:
        """Returns the newest action; a stop outlasts whatever was typed after it.

        A console that is gone counts as an operator who wants to stop and quit.

        Args:
            t: monotonic time [s].
        """
        action = Operator.NONE
        for data in waiting(self._socket.recv, _LONGEST, _AT_ONCE):
            if not data:
                self.quitting = True
                return _severer(action, Operator.STOP)
            word = data.decode("ascii", "replace")
            if word == ALIVE:
                self._last_s = t
            elif word == "quit":
                self.quitting, action = True, _severer(action, Operator.STOP)
            elif word.startswith("key ") and word[4:] in ARROWS:
                self.keys.append(ARROWS.index(word[4:]))
            elif word.startswith("turn "):
                self.turned_rad += turn_of(word[5:]) or 0.0
            elif word in ACTIONS:
                action = _severer(action, ACTIONS[word])
            else:
                self._select(word)
        if t - self._last_s > SILENCE_S:
            self.quitting, action = True, _severer(action, Operator.STOP)
        return action

    def report(self, status: dict[str, Any]) -> None:
        """Sends a status; one for which there is no room is lost."""
        try:
            self._socket.send(json.dumps(status).encode("ascii"))
        except OSError:
            return

    def _select(self, word: str) -> None:
        """Selects a policy that there is; anything else changes nothing."""
        name, _, number = word.partition(" ")
        digits = number.isascii() and number.isdigit() and len(number) < 4
        if name == "policy" and digits and int(number) < self._policies:
            self.selected = int(number)


def _severer(action: Operator, asked: Operator) -> Operator:
    """The newer of two actions; off rather than stop, and stop rather than others."""
    if action == Operator.OFF or (action in _URGENCY and asked not in _URGENCY):
        return action
    return asked
