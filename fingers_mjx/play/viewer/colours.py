"""One colour for one thing, in the scene, the plots and the legend."""

import mujoco
import numpy as np

from envs.hand.spec import hand_spec
from fingers_mjx.pictures.raycast import geom_colours

Rgb = tuple[int, int, int]

OKABE_ITO: tuple[Rgb, ...] = (
    (204, 121, 167),
    (0, 114, 178),
    (0, 158, 115),
    (230, 159, 0),
    (86, 180, 233),
)
"""For fingers that look alike; the colour-blind see them differ."""
FORCE: Rgb = (160, 0, 15)
"""No finger's, however a browser lights it."""
PUSH: Rgb = (140, 40, 160)
GHOST: Rgb = (60, 130, 220)
AXES: tuple[Rgb, ...] = ((240, 0, 0), (0, 200, 0), (0, 0, 240))
"""Of x, y and z, as the page draws frames."""
COMMAND: Rgb = (20, 20, 20)
ACHIEVED: Rgb = (70, 150, 220)


def finger_colours(model: mujoco.MjModel) -> tuple[Rgb, ...]:
    """Returns a colour for each finger: its own, unless two fingers share one."""
    tips = [model.geom(name).id for name in hand_spec(model).tip_spheres]
    own = np.rint(255 * geom_colours(model)[tips]).astype(int)
    if len(np.unique(own, axis=0)) < len(own):
        return OKABE_ITO[: len(own)]
    return tuple((red, green, blue) for red, green, blue in own.tolist())


def hex_of(colour: Rgb) -> str:
    """Returns a colour as HTML writes it, e.g. `#d53c28`."""
    return "#{:02x}{:02x}{:02x}".format(*colour)
