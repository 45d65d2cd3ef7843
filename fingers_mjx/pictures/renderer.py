"""What draws pictures: MuJoCo's renderer on a GPU, else ray casting on the CPU."""

import contextlib
from collections.abc import Callable, Iterator

import mujoco
import numpy as np
from jaxtyping import UInt8

from envs.errors import InputError, one_of
from fingers_mjx.pictures.camera import Camera
from fingers_mjx.pictures.opengl import OpenGlRenderer, renderer_name
from fingers_mjx.pictures.raycast import render
from fingers_mjx.pictures.shade import Look

RENDERERS = ("auto", "mujoco", "raycast")
"""`auto` takes MuJoCo's where a GPU draws: in software it is not faster."""
_BALL = "<mujoco><worldbody><geom size='0.1'/></worldbody></mujoco>"

Draw = Callable[[mujoco.MjData, Camera], UInt8[np.ndarray, "h w 3"]]


@contextlib.contextmanager
def renderer(
    name: str, model: mujoco.MjModel, size: tuple[int, int], look: Look | None = None
) -> Iterator[Draw]:
    """Gives a function that draws the poses of a scene.

    Args:
        name: out of `RENDERERS`.
        model: the scene.
        size: width and height of the pictures in pixels.
        look: light and colours; `Look()` if not given.

    Raises:
        InputError: an unknown name, or MuJoCo's renderer where OpenGL does not work.
    """
    if name not in RENDERERS:
        raise InputError("--renderer", "", name, one_of(RENDERERS, name))
    look = look or Look()
    opengl = None if name == "raycast" else _opengl(name, model, size, look)
    if opengl is None:
        yield lambda data, camera: render(model, data, camera, size, look)
        return
    try:
        yield opengl.draw
    finally:
        opengl.close()


def drawn_by() -> str:
    """Says in words what `auto` draws with on this machine."""
    scene = mujoco.MjModel.from_xml_string(_BALL)
    opengl = _opengl("auto", scene, (64, 64), Look())
    if opengl is None:
        return "ray casting on the CPU"
    try:
        return f"OpenGL on {renderer_name()}"
    finally:
        opengl.close()


def _opengl(
    name: str, model: mujoco.MjModel, size: tuple[int, int], look: Look
) -> OpenGlRenderer | None:
    """Returns MuJoCo's renderer; None where `auto` does without."""
    try:
        found = OpenGlRenderer(model, size, look)
    except InputError:
        if name == "mujoco":
            raise
        return None
    if name == "mujoco" or found.hardware:
        return found
    found.close()
    return None
