"""Messages between the console and the supervisor's process."""

import json
import socket
from collections import deque
from typing import Any

from fingers_robot.behaviour.keys import ARROWS
from fingers_robot.safety.types import Operator
from fingers_robot.waiting import waiting

_LONGEST = 65536
_AT_ONCE = 64  # words that one step of the loop takes
ACTIONS = {"arm": Operator.ARM, "stop": Operator.STOP, "clear": Operator.CLEAR}


class ConsoleLink:
    """The supervisor's end: actions in, status out; never blocks.

    Args:
        end: the socket.
    """

    def __init__(self, end: socket.socket):
        self._socket = end
        end.setblocking(False)
        self.quitting = False
        self.selected: int | None = None
        self.keys: deque[int] = deque()

    def poll(self) -> Operator:
        """Returns the newest action; a stop outlasts whatever was typed after it.

        A console that is gone counts as an operator who wants to stop and quit.
        """
        action = Operator.NONE
        for data in waiting(self._socket.recv, _LONGEST, _AT_ONCE):
            if not data:
                self.quitting = True
                return Operator.STOP
            word = data.decode("ascii", "replace")
            if word == "quit":
                self.quitting, action = True, Operator.STOP
            elif word.startswith("policy ") and word[7:].isdigit():
                self.selected = int(word[7:])
            elif word.startswith("key ") and word[4:] in ARROWS:
                self.keys.append(ARROWS.index(word[4:]))
            else:
                asked = ACTIONS.get(word, action)
                action = action if action == Operator.STOP else asked
        return action

    def report(self, status: dict[str, Any]) -> None:
        """Sends a status; one for which there is no room is lost."""
        try:
            self._socket.send(json.dumps(status).encode("ascii"))
        except OSError:
            return
