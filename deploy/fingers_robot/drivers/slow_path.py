"""The slow path to a WUJI hand: read-back and power, in a thread of its own."""

import threading
import time
from collections import deque
from typing import Any

import numpy as np

from fingers_robot.reading import Health

PERIOD_S = 0.2
TIMEOUT_S = 0.12
_CLOSE_S = 1.0


class SlowPath:
    """Asks a hand for its health five times a second and switches its power.

    A request for power is served before the next read-back. Once a transaction has
    failed, only requests to de-energize are still tried; `health` raises the failure.

    Args:
        hand: a `wujihandpy.Hand` that nobody else asks anything on this path.
    """

    def __init__(self, hand: Any):
        self._hand = hand
        self._wake = threading.Event()
        # The newest request at the end; taken and added without ever losing one.
        self._wanted: deque[bool] = deque(maxlen=1)
        self._confirmed: bool | None = False  # the driver has just de-energized it
        self._health: Health | None = None
        self._error: Exception | None = None
        self._open = True
        self._thread = threading.Thread(target=self._run, name="slow path", daemon=True)
        self._thread.start()

    def health(self) -> Health | None:
        """Returns the newest read-back.

        Raises:
            ConnectionError: the hand does not answer.
        """
        if self._error is not None:
            raise ConnectionError(f"slow path: {self._error}") from self._error
        return self._health

    def ask_enabled(self, enabled: bool) -> None:
        """Asks for power on or off; returns at once."""
        self._wanted.append(enabled)
        self._wake.set()

    def close(self) -> None:
        """De-energizes the hand and ends the thread."""
        self.ask_enabled(False)
        self._open = False
        self._wake.set()
        self._thread.join(timeout=_CLOSE_S)

    def _run(self) -> None:
        due = time.monotonic()
        while self._open or self._wanted:
            try:
                self._switch()
                if time.monotonic() >= due and self._error is None:
                    self._health = self._read()
                    due = time.monotonic() + PERIOD_S
            except Exception as error:
                self._error = error
                self._confirmed = None
                if not self._open:
                    return
            self._wake.wait(timeout=max(0.0, due - time.monotonic()) or PERIOD_S)
            self._wake.clear()

    def _switch(self) -> None:
        if not self._wanted:
            return
        wanted = self._wanted.pop()
        if wanted and self._error is not None:
            return
        self._confirmed = None
        self._hand.write_joint_enabled(wanted, timeout=TIMEOUT_S)
        # The write returns once the hand has acknowledged it.
        self._confirmed = wanted
        if self._error is None:
            self._health = self._read()

    def _read(self) -> Health:
        hand, begun_s = self._hand, time.monotonic()
        pos = hand.read_joint_actual_position(timeout=TIMEOUT_S)
        temperature = hand.read_joint_temperature(timeout=TIMEOUT_S)
        error = hand.read_joint_error_code(timeout=TIMEOUT_S)
        effort = hand.read_joint_effort_limit(timeout=TIMEOUT_S)
        volts = hand.read_input_voltage(timeout=TIMEOUT_S)
        return Health(
            t_s=begun_s,
            enabled=self._confirmed is True,
            disabled=self._confirmed is False,
            temperature_c=np.array(temperature, np.float64).reshape(-1),
            bus_v=float(volts),
            error_code=np.array(error, np.uint32).reshape(-1),
            effort_limit_a=np.array(effort, np.float64).reshape(-1),
            pos_rad=np.array(pos, np.float64).reshape(-1),
        )
