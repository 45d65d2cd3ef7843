"""What is drawn around the hand: floor, frame V, forces, springs, pushes, the ghost."""

import mujoco
import numpy as np
import viser
from jaxtyping import Float

from fingers_mjx.play.viewer.bodies import Bodies
from fingers_mjx.play.viewer.colours import FORCE, GHOST, PUSH, Rgb, finger_colours
from fingers_mjx.play.viewer.view import Arrows, Poses, Springs, View

WORLD = "/world"
NEAR = "/world/near"
"""On the floor under the palm: what browsers draw late is then drawn nearly right."""
FORCE_M_PER_N = 0.03
AXIS_M = 0.06
TILE_M = 0.05
OPACITY, GHOST_OPACITY = 0.5, 0.45
"""Of the hands: a force goes up through the finger that it acts on, and is seen."""


class Scene:
    """The three-dimensional part of the page.

    Args:
        server: of the page.
        model: what is simulated.
        with_ghost: whether a measured log is shown beside it.
    """

    def __init__(
        self, server: viser.ViserServer, model: mujoco.MjModel, with_ghost: bool
    ):
        self._server = server
        self._world, self._turn = (
            server.scene.add_frame(WORLD, show_axes=False),
            np.eye(3),
        )
        server.scene.add_grid(
            f"{WORLD}/floor",
            cell_size=TILE_M,
            section_size=4 * TILE_M,
            infinite_grid=True,
            fade_distance=3.0,
            plane_color=(232, 236, 240),
            plane_opacity=0.6,
        )
        self.hand = Bodies(server, f"{WORLD}/hand", model, opacity=OPACITY)
        self.ghost: Bodies | None = None
        if with_ghost:
            name = f"{WORLD}/ghost"
            self.ghost = Bodies(server, name, model, GHOST, GHOST_OPACITY)
        self._frame_v = _add_frame(server, f"{WORLD}/frame_v")
        self._near = server.scene.add_frame(NEAR, show_axes=False)
        self._forces = _ArrowSet(server, f"{NEAR}/forces", FORCE)
        self._push = _ArrowSet(server, f"{NEAR}/push", PUSH)
        self.colours = finger_colours(model)
        self._springs = _SpringSet(server, f"{NEAR}/springs", self.colours)
        server.initial_camera.position = (0.29, 0.27, 0.17)
        server.initial_camera.look_at = (0.03, 0.03, 0.04)

    def face(self, heading_rad: float) -> None:
        """Turns the world so that this heading points along x of the page."""
        half, cos, sin = heading_rad / 2, np.cos(heading_rad), np.sin(heading_rad)
        self._world.wxyz = (np.cos(half), 0.0, 0.0, -np.sin(half))
        self._turn = np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])

    def show(self, view: View, layers: frozenset[str], follow: bool) -> None:
        """Draws a control step.

        Args:
            view: what there is to see.
            layers: what of it is drawn, out of `LAYERS`.
            follow: whether the hand stays in the middle of the page.
        """
        self.hand.move(view.bodies)
        self._frame_v.position = view.frame_v.pos_w[0]
        self._frame_v.wxyz = view.frame_v.quat_w[0]
        self._frame_v.visible = "frame V" in layers
        middle = view.bodies.pos_w[0] * [1.0, 1.0, 0.0]
        self._near.position = middle
        contacts = view.contacts if "contact forces" in layers else None
        springs = view.springs if "footprint springs" in layers else None
        self._forces.show(contacts, middle)
        self._push.show(view.push, middle)
        self._springs.show(springs, middle)
        self._world.position = -self._turn @ middle if follow else np.zeros(3)

    def show_ghost(self, poses: Poses | None, aside_w: Float[np.ndarray, "3"]) -> None:
        """Draws the measured hand.

        Args:
            poses: of its bodies; None hides it, where the log has no reading.
            aside_w: from where it would be to where it is drawn [m].
        """
        if self.ghost is None:
            return
        self.ghost.root.visible = poses is not None
        self.ghost.root.position = aside_w
        if poses is not None:
            self.ghost.move(poses)


LAYERS = ("contact forces", "footprint springs", "frame V")


class _ArrowSet:
    """Forces as arrows of one colour."""

    def __init__(self, server: viser.ViserServer, name: str, colour: Rgb):
        self._handle = server.scene.add_arrows(
            name,
            np.zeros((1, 2, 3), np.float32),
            colour,
            shaft_radius=0.003,
            head_radius=0.008,
            head_length=0.016,
            visible=False,
        )

    def show(self, arrows: Arrows | None, middle_w: np.ndarray) -> None:
        shown = arrows is not None and len(arrows.at_w) > 0
        self._handle.visible = shown
        if arrows is not None and shown:
            at = arrows.at_w - middle_w
            self._handle.points = _pairs(at, at + FORCE_M_PER_N * arrows.force_w)


class _SpringSet:
    """Springs as lines, and their targets as balls, in the colours of the fingers."""

    def __init__(self, server: viser.ViserServer, name: str, colours: tuple[Rgb, ...]):
        ends = np.repeat(np.array(colours, np.uint8)[:, None], 2, axis=1)
        self._lines = server.scene.add_line_segments(
            f"{name}/lines",
            np.zeros((len(colours), 2, 3), np.float32),
            ends,
            thickness=0.003,
            visible=False,
        )
        self._targets = [
            server.scene.add_icosphere(
                f"{name}/target_{index}", radius=0.005, color=colour, visible=False
            )
            for index, colour in enumerate(colours)
        ]

    def show(self, springs: Springs | None, middle_w: np.ndarray) -> None:
        self._lines.visible = springs is not None
        for index, target in enumerate(self._targets):
            target.visible = springs is not None
            if springs is not None:
                target.position = springs.target_w[index] - middle_w
        if springs is not None:
            ends = springs.tip_w - middle_w, springs.target_w - middle_w
            self._lines.points = _pairs(*ends)


def _pairs(
    a: Float[np.ndarray, "n 3"], b: Float[np.ndarray, "n 3"]
) -> Float[np.ndarray, "n 2 3"]:
    return np.stack([a, b], axis=1).astype(np.float32)


def _add_frame(server: viser.ViserServer, name: str) -> viser.FrameHandle:
    """Adds the axes of V with their names."""
    handle = server.scene.add_frame(name, axes_length=AXIS_M, axes_radius=0.0016)
    for index, text in enumerate(("V x", "V y", "V z")):
        end = np.zeros(3)
        end[index] = 1.15 * AXIS_M
        server.scene.add_label(f"{name}/axis_{index}", text, position=end)
    return handle
