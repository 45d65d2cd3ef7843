"""The command path of the hand: delay, firmware low-pass, speed limit; in NumPy."""

import math
from collections.abc import Sequence

import numpy as np

from fingers_robot.reading import Array


class CommandPath:
    """Delay → first-order low-pass → speed limit, one call per physics step.

    delay:    x_k = u(t_k − T), rounded to whole physics steps
    low-pass: y_k = y_{k−1} + (1 − e^{−2π f_c Δt}) (x_k − y_{k−1})
    speed:    c_k = clip(y_k, c_{k−1} ± v_max Δt)

    Args:
        start_rad: targets that have been sent for ever, [20].
        dt_s: physics step [s].
        delay_s: transport delay [s].
        lowpass_hz: cutoff [Hz]; None: no filter.
        slew_rad_s: speed limit of each joint, or of all [rad/s]; infinity: no limit.
    """

    def __init__(
        self,
        start_rad: Array,
        dt_s: float,
        delay_s: float,
        lowpass_hz: float | None,
        slew_rad_s: Sequence[float] | float,
    ):
        self._slots = round(delay_s / dt_s) + 1
        self._gain = 1.0
        if lowpass_hz is not None:
            self._gain = -math.expm1(-2 * math.pi * lowpass_hz * dt_s)
        self._reach = dt_s * np.asarray(slew_rad_s, np.float64)
        self.reset(start_rad)

    def reset(self, start_rad: Array) -> None:
        """Starts at rest: the firmware's filter begins at the actual position."""
        self._line = [start_rad] * self._slots
        self._filtered = self._command = np.array(start_rad, np.float64)

    def step(self, target_rad: Array) -> Array:
        """Returns the command that the servos follow in this physics step [rad]."""
        self._line = [target_rad, *self._line[:-1]]
        change = self._line[-1] - self._filtered
        self._filtered = self._filtered + self._gain * change
        reach = np.clip(self._filtered - self._command, -self._reach, self._reach)
        self._command = self._command + reach
        return self._command
