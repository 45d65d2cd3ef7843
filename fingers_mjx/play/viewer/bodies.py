"""The bodies of a model as meshes on the page, solid or translucent."""

from collections import defaultdict
from collections.abc import Iterator

import mujoco
import numpy as np
import trimesh
import viser
from mjviser.conversions import merge_geoms
from trimesh.graph import smooth_shade

from fingers_mjx.pictures.raycast import PLANE, geom_colours
from fingers_mjx.play.viewer.colours import Rgb
from fingers_mjx.play.viewer.view import MOVING, Poses

SHOWN_GROUPS = (0, 1, 2)
"""Geom groups, as in MuJoCo's viewer."""
SMOOTH_RAD = 0.6
"""Edges that are sharper are drawn as edges."""


class Bodies:
    """Meshes that follow the bodies of a model.

    Args:
        server: of the page.
        name: where they hang in the scene.
        model: whose geoms are drawn; planes are not.
        colour: of all of them, which then cast no shadows; their own if None.
        opacity: 1 hides what is behind.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        name: str,
        model: mujoco.MjModel,
        colour: Rgb | None = None,
        opacity: float | None = None,
    ):
        self.root = server.scene.add_frame(name, show_axes=False)
        self._frames: dict[int, viser.FrameHandle] = {}
        for number, (body, own, mesh) in enumerate(_parts(model)):
            frame = f"{name}/{body}"
            if body not in self._frames:
                handle = server.scene.add_frame(frame, show_axes=False)
                self._frames[body] = handle
            server.scene.add_mesh_simple(
                f"{frame}/{number}",
                mesh.vertices.astype(np.float32),
                mesh.faces.astype(np.uint32),
                color=colour or own,
                opacity=opacity,
                cast_shadow=colour is None,
            )

    def move(self, poses: Poses) -> None:
        """Moves all bodies."""
        for body, frame in self._frames.items():
            if body >= MOVING:
                frame.position = poses.pos_w[body - MOVING]
                frame.wxyz = poses.quat_w[body - MOVING]


def _parts(model: mujoco.MjModel) -> Iterator[tuple[int, Rgb, trimesh.Trimesh]]:
    """Returns body, colour and mesh of the geoms of one body and colour together."""
    shown = np.isin(model.geom_group, SHOWN_GROUPS) & (model.geom_rgba[:, 3] > 0.0)
    shown &= model.geom_type != PLANE
    colours = np.rint(255 * geom_colours(model)).astype(int)
    alike: dict[tuple[int, Rgb], list[int]] = defaultdict(list)
    for geom in np.flatnonzero(shown):
        red, green, blue = colours[geom].tolist()
        alike[int(model.geom_bodyid[geom]), (red, green, blue)].append(int(geom))
    for (body, colour), geoms in alike.items():
        yield body, colour, smooth_shade(merge_geoms(model, geoms), SMOOTH_RAD)
