"""A gamepad through Linux' joystick interface, without any library."""

import os
import struct
from functools import partial

from fingers_deploy.errors import InputError
from fingers_robot.behaviour.command import Frame
from fingers_robot.waiting import waiting

_EVENT = struct.Struct("<IhBB")
_BUTTON, _AXIS, _INITIAL = 0x01, 0x02, 0x80
_FULL = 32767.0
QUIET_S = 2.0


class Joystick:
    """Sticks and dead-man button of a gamepad.

    The kernel reports changes only. A gamepad that is unplugged makes reading fail; a
    radio link that dies silently does not. So a stick that is held out without the
    slightest change for a while counts as lost, until it changes again.

    Args:
        path: the device, e.g. `/dev/input/js0`.
        axes: for each entry of the command, the axis and the sign that it is read with.
        deadman: number of the dead-man button.
        quiet_s: how long a stick may be held out without a change [s]; infinite for a
            gamepad whose receiver goes away with the link.

    Raises:
        InputError: the device cannot be opened.
    """

    def __init__(
        self,
        path: str = "/dev/input/js0",
        axes: tuple[tuple[int, float], ...] = ((1, -1.0), (0, -1.0), (3, -1.0)),
        deadman: int = 4,
        quiet_s: float = QUIET_S,
    ):
        try:
            self._file = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
        except OSError as error:
            raise InputError(path, "", error.strerror, "a gamepad") from error
        self._map, self._deadman, self._quiet_s = axes, deadman, quiet_s
        self._axes: dict[int, float] = {}
        self._buttons: dict[int, bool] = {}
        self._changed_s: float | None = None
        self._frame: Frame | None = None

    def poll(self, t: float) -> Frame | None:
        """Returns the sticks; an older frame while the gamepad is lost."""
        if not self._drain(t):
            return self._frame
        sticks = tuple(sign * self._axes.get(axis, 0.0) for axis, sign in self._map)
        held = any(abs(stick) > 0.1 for stick in sticks)
        if self._changed_s is None:
            self._changed_s = t
        if held and t - self._changed_s > self._quiet_s:
            return self._frame
        self._frame = Frame(t, sticks, self._buttons.get(self._deadman, False))
        return self._frame

    def close(self) -> None:
        """Lets go of the device."""
        os.close(self._file)

    def _drain(self, t: float) -> bool:
        """Takes all waiting events; returns whether the gamepad is still there."""
        for data in waiting(partial(os.read, self._file), _EVENT.size):
            if len(data) != _EVENT.size:
                return False
            self._changed_s = t
            _, value, kind, number = _EVENT.unpack(data)
            if kind & ~_INITIAL == _AXIS:
                self._axes[number] = max(value / _FULL, -1.0)
            elif kind & ~_INITIAL == _BUTTON:
                self._buttons[number] = bool(value)
        return True
