"""The same pictures as ray casting, drawn by MuJoCo's renderer where OpenGL works.

OpenGL finds what each pixel sees, lights it and casts the shadow; sky, floor tiles and
the curve from light to colour are those of `fingers_mjx.pictures.shade`.
"""

import copy
import importlib
import os
import warnings
from typing import Any

import mujoco
import numpy as np
from jaxtyping import Float, Int, UInt8

from envs.errors import InputError
from fingers_mjx.pictures.camera import Camera, pixel_centres, position, rays
from fingers_mjx.pictures.raycast import PLANE, geom_colours
from fingers_mjx.pictures.shade import (
    Look,
    checkerboard,
    encode,
    fade,
    linear,
    sky,
    unit,
)

PLATFORMS = ("egl", "osmesa", "glfw")
"""What makes a context, in the order in which it is tried; see `MUJOCO_GL`."""
PLATFORM = "PYOPENGL_PLATFORM"
"""Variable by which PyOpenGL knows which of them."""
SOFTWARE = ("llvmpipe", "softpipe", "swrast", "swiftshader")
"""Renderers on the CPU, which are not faster than ray casting."""
FINER = 2
"""Pixels drawn for each pixel of the picture, along each edge."""
FLOOR = 0.5
"""Brightness of the floor for OpenGL, which saturates at 1."""
SHININESS = 40.0 / 128.0
SHADOW_M = 1.0
"""Around what the camera looks at; beyond it OpenGL's shadows are noise."""
SKY = -1


class OpenGlRenderer:
    """Draws one scene; `close` frees what OpenGL holds.

    Args:
        model: the scene.
        size: width and height of the pictures in pixels.
        look: light and colours.

    Raises:
        InputError: OpenGL does not work here.
    """

    def __init__(self, model: mujoco.MjModel, size: tuple[int, int], look: Look):
        self._model, self._size, self._look = copy.copy(model), size, look
        self._fine = (FINER * size[0], FINER * size[1])
        screen = self._model.vis.global_
        screen.offwidth, screen.offheight = self._fine
        self._model.vis.quality.offsamples = 0
        self._model.vis.map.shadowclip = SHADOW_M / self._model.stat.extent
        self._context, self._drawing = _contexts(self._fine, self._model)
        buffer = mujoco.mjtFramebuffer.mjFB_OFFSCREEN
        mujoco.mjr_setBuffer(buffer, self._drawing)
        self._scene = mujoco.MjvScene(self._model, maxgeom=self._model.ngeom + 10)
        self._option = mujoco.MjvOption()
        self._option.geomgroup[:] = np.isin(np.arange(6), look.groups)
        self._option.sitegroup[:] = 0
        self._colours = linear(geom_colours(self._model))

    @property
    def hardware(self) -> bool:
        """Whether a graphics processor draws."""
        return not any(name in renderer_name().lower() for name in SOFTWARE)

    def draw(self, data: mujoco.MjData, camera: Camera) -> UInt8[np.ndarray, "h w 3"]:
        """Returns a picture, sRGB in [0, 255] [1].

        Args:
            data: poses of the geoms.
            camera: the point of view.

        Source:
            MuJoCo documentation, Visualization; the look is that of `raycast.render`.
        """
        self._context.make_current()
        self._update(data, camera)
        light = (self._pixels(False).astype(np.float32) / 255.0).reshape(-1, 3)
        geom = self._geoms()
        floor = (geom >= 0) & (self._model.geom_type[geom] == PLANE)
        rays_w = rays(camera, self._fine, pixel_centres(self._fine))
        light[geom == SKY] = sky(self._look, rays_w[geom == SKY])
        light[floor] = self._floor(light[floor], rays_w[floor], camera)
        width, height = self._size
        image = encode(light).reshape(height, FINER, width, FINER, 3)
        return np.rint(image.mean(axis=(1, 3))).astype(np.uint8)

    def close(self) -> None:
        """Frees what OpenGL holds; the renderer is of no use then."""
        self._drawing.free()
        self._context.free()

    def _update(self, data: mujoco.MjData, camera: Camera) -> None:
        """Puts geoms, camera and lights of the look into the scene."""
        view = mujoco.MjvCamera()
        view.lookat[:], view.distance = camera.lookat_w, camera.distance_m
        view.azimuth, view.elevation = camera.azimuth_deg, camera.elevation_deg
        self._model.vis.global_.fovy = camera.fovy_deg
        every = mujoco.mjtCatBit.mjCAT_ALL
        args = (self._model, data, self._option, None, view, every, self._scene)
        mujoco.mjv_updateScene(*args)
        for index in range(self._scene.ngeom):
            geom = self._scene.geoms[index]
            is_floor = geom.type == PLANE
            geom.rgba[:3] = FLOOR if is_floor else self._colours[geom.objid]
            geom.specular = 0.0 if is_floor else self._look.gloss
            geom.shininess, geom.emission, geom.reflectance = SHININESS, 0.0, 0.0
            geom.matid = -1
        self._light(camera)

    def _light(self, camera: Camera) -> None:
        """Key light with a shadow, and the dome as ambient light and one from above."""
        look, scene = self._look, self._scene
        scene.nlight = 2
        above, key = scene.lights[0], scene.lights[1]
        for light in (above, key):
            light.headlight, light.type = 0, mujoco.mjtLightType.mjLIGHT_DIRECTIONAL
            light.ambient[:], light.specular[:], light.castshadow = 0.0, 0.0, 0
            light.attenuation[:] = (1.0, 0.0, 0.0)
        above.dir[:], above.diffuse[:] = (0.0, 0.0, -1.0), 0.35 * look.ambient
        above.ambient[:] = 0.65 * look.ambient
        toward = unit(np.asarray(look.light_w))
        key.dir[:], key.diffuse[:], key.specular[:] = -toward, look.key, 1.0
        key.pos[:] = np.asarray(camera.lookat_w) + toward
        key.castshadow = 1
        scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = True

    def _pixels(self, ids: bool) -> UInt8[np.ndarray, "h w 3"]:
        """Draws the scene in its colours, or in colours that number its geoms."""
        for flag in ("SEGMENT", "IDCOLOR"):
            self._scene.flags[getattr(mujoco.mjtRndFlag, f"mjRND_{flag}")] = ids
        width, height = self._fine
        image, where = (
            np.zeros((height, width, 3), np.uint8),
            mujoco.MjrRect(0, 0, width, height),
        )
        mujoco.mjr_render(where, self._scene, self._drawing)
        mujoco.mjr_readPixels(image, None, where, self._drawing)
        return image[::-1]

    def _geoms(self) -> Int[np.ndarray, " pixels"]:
        """Returns the geom at each pixel, `SKY` where there is none."""
        red, green, blue = np.moveaxis(self._pixels(True).astype(np.int32), -1, 0)
        drawn = (red + 256 * green + 65536 * blue).reshape(-1) - 1
        geom_of = np.full(self._scene.ngeom + 1, SKY, np.int32)
        for index in range(self._scene.ngeom):
            geom = self._scene.geoms[index]
            geom_of[geom.segid] = geom.objid
        geom_of[-1] = SKY
        return geom_of[drawn]

    def _floor(
        self,
        light: Float[np.ndarray, "n 3"],
        rays_w: Float[np.ndarray, "n 3"],
        camera: Camera,
    ) -> Float[np.ndarray, "n 3"]:
        """Returns the floor's tiles in the light that OpenGL found there."""
        eye = position(camera)
        points = eye - eye[2] / rays_w[:, 2:] * rays_w
        tiles = light / FLOOR * checkerboard(self._look, points)
        far = np.linalg.norm(points - camera.lookat_w, axis=1)
        return fade(self._look, tiles, far)


def renderer_name() -> str:
    """Returns what draws in the current context, e.g. the name of a GPU."""
    gl = importlib.import_module("OpenGL.GL")
    return bytes(gl.glGetString(gl.GL_RENDERER) or b"").decode(errors="replace")


def _contexts(size: tuple[int, int], model: mujoco.MjModel) -> tuple[Any, Any]:
    """Makes OpenGL's and MuJoCo's context on the first platform where both can be made.

    One that has no display may give a context in which nothing can be drawn.

    Raises:
        InputError: none has; with what the first says.
    """
    asked, was = os.environ.get("MUJOCO_GL", ""), os.environ.get(PLATFORM)
    names, said = (asked,) if asked in PLATFORMS else PLATFORMS, []
    for name in names:
        # Missing libraries and displays are reported in as many ways as there are.
        try:
            return _contexts_of(name, size, model)
        except Exception as error:
            said.append(f"{name}: {error}")
    if was is None:
        os.environ.pop(PLATFORM, None)
    else:
        os.environ[PLATFORM] = was
    found = f"no OpenGL ({said[0]})"
    raise InputError("--renderer", "mujoco", found, "raycast, or one with OpenGL")


def _contexts_of(
    name: str, size: tuple[int, int], model: mujoco.MjModel
) -> tuple[Any, Any]:
    """The same on one platform; raises whatever that says."""
    os.environ[PLATFORM] = name if name != "glfw" else ""
    with warnings.catch_warnings(action="ignore"):  # of glfw, about each call
        context = importlib.import_module(f"mujoco.{name}").GLContext(*size)
        context.make_current()
        try:
            scale = mujoco.mjtFontScale.mjFONTSCALE_100
            return context, mujoco.MjrContext(model, scale)
        except Exception:
            context.free()
            raise
