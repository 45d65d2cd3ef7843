"""The last seconds of what is plotted."""

from collections import deque

import numpy as np
from jaxtyping import Float


class History:
    """Rows of a fixed width with their times; what is older than the window goes.

    Args:
        width: values in a row.
        window_s: how far back it reaches [s].
    """

    def __init__(self, width: int, window_s: float = 10.0):
        self._width, self._window_s = width, window_s
        self._rows: deque[np.ndarray] = deque()

    def add(self, t_s: float, values: Float[np.ndarray, " width"]) -> None:
        """Adds a row; time that runs backward begins anew.

        Args:
            t_s: time of the row [s].
            values: the row.
        """
        if self._rows and t_s <= self._rows[-1][0]:
            self._rows.clear()
        self._rows.append(np.concatenate([[t_s], values]))
        while t_s - self._rows[0][0] > self._window_s:
            self._rows.popleft()

    def columns(self) -> tuple[Float[np.ndarray, " rows"], ...]:
        """Returns times and one array for each value; a single 0 before any row."""
        if not self._rows:
            return (np.zeros(1),) * (1 + self._width)
        return tuple(np.stack(self._rows, axis=1))
