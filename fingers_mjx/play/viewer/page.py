"""The page in the browser: scene, knobs and plots, and where it is served."""

import contextlib
import io
import logging
import socket
from collections.abc import Iterator

import mujoco
import viser

from envs.errors import InputError
from fingers_mjx.play.viewer.dials import dials
from fingers_mjx.play.viewer.panel import Knobs, Panel
from fingers_mjx.play.viewer.plots import Plots
from fingers_mjx.play.viewer.scene import Scene
from fingers_mjx.play.viewer.view import View

HOST = "127.0.0.1"
"""Who may use this machine may look; nobody else."""
LIFT = """**Lift of each fingertip**: running average of its vertical speed at the
stepping frequency (colour) and phase (grey). A thick ring is paid now, most from the
outer circle on."""


class Page:
    """Scene, knobs and plots of one simulation.

    Args:
        server: from `serving`.
        model: what is simulated.
        knobs: what there is to turn.
        title: of the page.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        model: mujoco.MjModel,
        knobs: Knobs,
        title: str,
    ):
        self.server = server
        server.gui.configure_theme(show_logo=False, show_share_button=False)
        server.gui.set_panel_label(title)
        self.scene = Scene(server, model, knobs.ghost is not None)
        self.panel = Panel(server, knobs, self.scene.colours)
        panel = server.gui.add_panel()
        with panel.add_tab("What it does"):
            self.plots = Plots(server)
            server.gui.add_markdown(LIFT)
            self._dials = server.gui.add_html(dials(None, self.scene.colours))
        panel.dock_left()
        panel.set_width(340)
        server.gui.main_panel.dock_right()
        server.gui.main_panel.set_width(340)

    def draw(self, view: View) -> None:
        """Draws a control step."""
        with self.server.atomic():
            self.scene.show(view, self.panel.layers, self.panel.follow)

    def plot(self, view: View) -> None:
        """Draws the plots, more rarely than the scene."""
        self.plots.draw()
        self._dials.content = dials(view.lifts, self.scene.colours)


@contextlib.contextmanager
def serving(port: int) -> Iterator[viser.ViserServer]:
    """Serves an empty page on this machine until the block is left.

    Raises:
        InputError: the port is taken.
    """
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((HOST, port))
        except OSError as error:
            found = f"{port} ({error.strerror})"
            raise InputError("--port", "", found, "a free port") from error
    # It reports every browser that hangs up in the middle of a sentence.
    logging.getLogger("websockets.server").setLevel(logging.CRITICAL)
    with _quietly():
        server = viser.ViserServer(host=HOST, port=port, verbose=False)
    try:
        yield server
    finally:
        with _quietly():
            server.stop()


def _quietly() -> contextlib.redirect_stdout[io.StringIO]:
    """Keeps viser's own words from standard output, which is ours."""
    return contextlib.redirect_stdout(io.StringIO())
