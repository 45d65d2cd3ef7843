"""Key events of the keyboard that the hand presses, from Linux' event interface."""

import os
import struct
from functools import partial
from typing import Protocol

from fingers_deploy.errors import InputError
from fingers_robot.waiting import waiting

# struct input_event on a 64-bit system: time (two words), type, code, value.
_EVENT = struct.Struct("<qqHHi")
_KEY, _DOWN = 1, 1
CODES = {103: "up", 105: "left", 106: "right", 108: "down"}
"""Key codes of the kernel (`linux/input-event-codes.h`) for the arrows."""


class KeySource(Protocol):
    """Where key events come from."""

    lost: bool

    def poll(self) -> tuple[str, ...]:
        """Returns the keys that went down since the last call; never blocks."""
        ...


class Keyboard:
    """A keyboard on this computer.

    Args:
        path: its device, e.g. `/dev/input/by-id/usb-…-event-kbd`.

    Raises:
        InputError: the device cannot be opened.
    """

    def __init__(self, path: str):
        try:
            self._file = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
        except OSError as error:
            raise InputError(path, "", error.strerror, "a keyboard") from error
        self.lost = False

    def poll(self) -> tuple[str, ...]:
        """Returns the keys that went down; others than the arrows as `key N`."""
        pressed = []
        if self.lost:
            return ()
        for data in waiting(partial(os.read, self._file), _EVENT.size):
            if len(data) != _EVENT.size:
                self.lost = True
                break
            _, _, kind, code, value = _EVENT.unpack(data)
            if kind == _KEY and value == _DOWN:
                pressed.append(CODES.get(code, f"key {code}"))
        return tuple(pressed)
