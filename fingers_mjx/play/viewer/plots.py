"""Live plots of the command and of what the hand makes of it."""

import numpy as np
import viser
from viser import uplot

from fingers_mjx.play.viewer.colours import ACHIEVED, COMMAND, hex_of
from fingers_mjx.play.viewer.history import History
from fingers_mjx.play.viewer.view import View

PARTS = (("forward", "m/s", 0.25), ("left", "m/s", 0.25), ("turn", "rad/s", 1.5))
"""Component, unit, and the largest size that is drawn."""
HEIGHT_PX = 112


class Plots:
    """One plot for each component of the velocity in V.

    Args:
        server: of the page; the plots go where its context is.
    """

    def __init__(self, server: viser.ViserServer):
        self._history = History(2 * len(PARTS))
        self._handles = [_plot(server, self._data(i)) for i in range(len(PARTS))]
        for handle, (name, unit, most) in zip(self._handles, PARTS, strict=True):
            handle.title = f"{name} [{unit}]"
            handle.scales = {"x": {"time": False}, "y": {"range": (-most, most)}}

    def add(self, t_s: float, view: View) -> None:
        """Adds a control step, without drawing it."""
        both = zip(view.velocity, view.command, strict=True)
        self._history.add(t_s, np.ravel(list(both)))

    def draw(self) -> None:
        """Draws the last seconds."""
        for index, handle in enumerate(self._handles):
            handle.data = self._data(index)

    def _data(self, index: int):
        times, *values = self._history.columns()
        return (times, values[2 * index], values[2 * index + 1])


def _plot(server: viser.ViserServer, data) -> viser.GuiUplotHandle:
    series = (
        uplot.Series(label="time [s]"),
        uplot.Series(label="achieved", stroke=hex_of(ACHIEVED), width=1.5),
        uplot.Series(label="command", stroke=hex_of(COMMAND), width=2.0, dash=(6, 4)),
    )
    axes = (uplot.Axis(size=28), uplot.Axis(size=44))
    legend = uplot.Legend(live=False)
    gui = server.gui
    return gui.add_uplot(data, series, axes=axes, legend=legend, height=HEIGHT_PX)
