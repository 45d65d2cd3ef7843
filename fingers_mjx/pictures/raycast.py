"""Pictures of a MuJoCo scene with no GPU, no OpenGL and no display: ray casting.

`mujoco.mj_multiRay` finds what each pixel sees; shading is NumPy. One core draws a
320x240 picture in about 0.1 s. Threads do not help (two take as long as one after the
other).
"""

import copy
from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Float, Int, UInt8

from fingers_mjx.pictures.camera import Camera, pixel_centres, position, rays
from fingers_mjx.pictures.shade import (
    Look,
    Surface,
    checkerboard,
    encode,
    fade,
    linear,
    lit,
    rough,
    sky,
    unit,
)

LIGHT_FAR_M = 4.0
SURFACE_GAP_M = 2e-4
PLANE = int(mujoco.mjtGeom.mjGEOM_PLANE)
DEFAULT_RGBA = np.array([0.5, 0.5, 0.5, 1.0], np.float32)


@dataclass(frozen=True)
class Hits:
    """What rays from one point meet first.

    Attributes:
        geom: id of the geom, -1 for none.
        distance_m: along the ray; -1 for none.
        normal_w: unit normal of the surface, towards the outside.
    """

    geom: Int[np.ndarray, " n"]
    distance_m: Float[np.ndarray, " n"]
    normal_w: Float[np.ndarray, "n 3"]


def render(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    camera: Camera,
    size: tuple[int, int] = (640, 480),
    look: Look | None = None,
    samples: int = 2,
) -> UInt8[np.ndarray, "h w 3"]:
    """Returns a picture of the scene, sRGB [1] in 0 … 255.

    A pixel is the mean = Σ colours / samples² of rays on a grid inside it; away from
    edges, where that changes nothing, of one ray.

    Args:
        model: the scene; planes become a checkerboard, other geoms take the colour of
            their material or their own.
        data: poses of the geoms (`mj_kinematics` or more has been called).
        camera: the point of view.
        size: width and height in pixels.
        look: light and colours; `Look()` if not given.
        samples: edges are drawn with samples x samples rays per pixel; 1 for none.

    Source:
        Ours; adaptive supersampling after T. Whitted, An Improved Illumination Model
        for Shaded Display, CACM 1980.
    """
    scene = _Scene(exact(model), data, camera, size, look or Look())
    centres = pixel_centres(size)
    image = scene.colours(centres)
    if samples > 1:
        edges = rough(image.reshape(size[1], size[0], 3)).reshape(-1)
        image[edges] = _supersampled(scene, centres[edges], samples)
    return np.rint(image).astype(np.uint8).reshape(size[1], size[0], 3)


def exact(model: mujoco.MjModel) -> mujoco.MjModel:
    """Returns a copy for `cast` in which no geom is overlooked.

    MuJoCo 3.17 culls a body in `mj_multiRay` by a bounding volume that is in the wrong
    place when the body is turned and its centre of mass is away from its geoms, so that
    rays pass through it. Without that volume every geom is tested and the result agrees
    with `mj_ray`; meshes keep their own.
    """
    without_bounds = copy.copy(model)
    without_bounds.body_bvhadr[:] = -1
    without_bounds.body_bvhnum[:] = 0
    return without_bounds


def cast(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    origin_w: Float[np.ndarray, "3"],
    rays_w: Float[np.ndarray, "n 3"],
    groups: tuple[int, ...] = (0, 1, 2),
) -> Hits:
    """Returns what unit rays from one point meet first; geoms of alpha 0 are air.

    Smallest t ≥ 0 [m] with o + t d = a point of a geom.

    Args:
        model: the scene, from `exact`.
        data: poses of the geoms.
        origin_w: where all rays start [m].
        rays_w: unit directions.
        groups: geom groups that are not air.

    Source:
        `mj_multiRay` of MuJoCo.
    """
    count = len(rays_w)
    geom = np.full(count, -1, np.int32)
    distance = np.full(count, -1.0)
    normal = np.zeros((count, 3))
    shown = np.isin(np.arange(6), groups).astype(np.uint8)
    flat = np.ascontiguousarray(rays_w, np.float64).reshape(-1)
    args = (shown, True, -1, geom, distance, normal.reshape(-1), count, mujoco.mjMAXVAL)
    mujoco.mj_multiRay(model, data, origin_w, flat, *args)
    return Hits(geom, distance, normal)


def seen_from(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    light_w: Float[np.ndarray, "3"],
    points_w: Float[np.ndarray, "n 3"],
    groups: tuple[int, ...] = (0, 1, 2),
) -> Float[np.ndarray, " n"]:
    """Returns 1 where nothing stands between a point [m] and the light, else 0 [1].

    Planes cast no shadow: only rays d from the light l that meet the sphere (c, r)
    around all other geoms, ‖c − l‖² − (d·(c − l))² < r², are tested, which spares most
    of the floor.

    Source:
        Ours; shadow rays after T. Whitted, CACM 1980.
    """
    ray = points_w - light_w
    length = np.linalg.norm(ray, axis=1)
    ray /= length[:, None]
    centre, radius = bounding_sphere(model, data)
    along = ray @ (centre - light_w)
    near = np.sum((centre - light_w) ** 2) - along**2 < radius**2
    hits = cast(model, data, light_w, ray[near], groups)
    free = np.ones(len(points_w))
    blocked = (hits.geom >= 0) & (hits.distance_m < length[near] - SURFACE_GAP_M)
    free[near] = ~blocked
    return free


def bounding_sphere(
    model: mujoco.MjModel, data: mujoco.MjData
) -> tuple[Float[np.ndarray, "3"], float]:
    """Returns centre c [m] and radius r [m] of a sphere around all geoms but planes.

    c = (min x + max x) / 2 of the geoms' centres x, r = max (‖x − c‖ + rbound).

    Source:
        Ours; not the smallest sphere, but one that is found at once.
    """
    solid = model.geom_type != PLANE
    if not solid.any():
        return np.zeros(3), 0.0
    places, reach = data.geom_xpos[solid], model.geom_rbound[solid]
    centre = (places.min(axis=0) + places.max(axis=0)) / 2
    return centre, float(np.max(np.linalg.norm(places - centre, axis=1) + reach))


def geom_colours(model: mujoco.MjModel) -> Float[np.ndarray, "geoms 3"]:
    """Returns each geom's sRGB colour [1] in 0 … 1 = its own, else its material's.

    Source:
        MuJoCo's XML reference: rgba of a geom counts where it is not the default.
    """
    own, material = model.geom_rgba[:, :3], model.geom_matid
    if model.nmat == 0:
        return own.copy()
    unset = np.all(model.geom_rgba == DEFAULT_RGBA, axis=1)
    from_material = (material >= 0) & unset
    return np.where(from_material[:, None], model.mat_rgba[material, :3], own)


def lamps(look: Look) -> tuple[Float[np.ndarray, "k 3"], Float[np.ndarray, "s 3"]]:
    """Returns unit directions [1] towards samples of the key light and of the sky dome.

    The key light is a disc and the dome a cosine-weighted hemisphere, z = √(1 − x² −
    y²) over the unit disc, not below 0.15; both are sampled on a Fibonacci spiral, so
    that the same picture comes out every time.

    Source:
        Malley's method for the dome; H. Vogel, A Better Way to Construct the Sunflower
        Head, Mathematical Biosciences 1979, for the spiral.
    """
    toward = unit(np.asarray(look.light_w, float))
    side = unit(np.cross(toward, [0.0, 1.0, 0.0]))
    disc = look.light_size * _spiral(look.light_samples)
    key = toward + disc[:, :1] * side + disc[:, 1:] * np.cross(toward, side)
    dome = _spiral(look.sky_samples)
    up = np.sqrt(1.0 - np.sum(dome**2, axis=1, keepdims=True))
    return unit(key), np.concatenate([dome, np.maximum(up, 0.15)], axis=1)


@dataclass(frozen=True)
class _Scene:
    """One scene under one camera."""

    model: mujoco.MjModel
    data: mujoco.MjData
    camera: Camera
    size: tuple[int, int]
    look: Look

    def colours(self, points_px: np.ndarray) -> np.ndarray:
        """Returns sRGB values in [0, 255] at image points."""
        rays_w = rays(self.camera, self.size, points_px)
        eye = position(self.camera)
        hits = cast(self.model, self.data, eye, rays_w, self.look.groups)
        light = sky(self.look, rays_w)
        hit = np.flatnonzero(hits.geom >= 0)
        if len(hit):
            light[hit] = self._surfaces(hits, hit, rays_w[hit], eye)
        return encode(light)

    def _surfaces(self, hits, hit, rays_w, eye) -> np.ndarray:
        geom, normals = hits.geom[hit], hits.normal_w[hit]
        points = eye + hits.distance_m[hit, None] * rays_w
        floor = self.model.geom_type[geom] == PLANE
        albedo = linear(geom_colours(self.model))[geom]
        albedo[floor] = checkerboard(self.look, points[floor])
        gloss = np.where(floor, 0.0, self.look.gloss)
        seen = [self._seen(points, lamp) for lamp in lamps(self.look)]
        surface = Surface(albedo, gloss, normals)
        light = lit(self.look, surface, rays_w, *seen)
        far = np.linalg.norm(points - self.camera.lookat_w, axis=1)
        return fade(self.look, light, np.where(floor, far, 0.0))

    def _seen(self, points: np.ndarray, lamps_w: np.ndarray) -> np.ndarray:
        """Returns the fraction of lamps that each point sees; 1 without lamps."""
        if len(lamps_w) == 0:
            return np.ones(len(points))
        places = np.asarray(self.camera.lookat_w) + LIGHT_FAR_M * lamps_w
        groups = self.look.groups
        seen = (seen_from(self.model, self.data, p, points, groups) for p in places)
        return sum(seen, start=np.zeros(len(points))) / len(lamps_w)


def _supersampled(scene: _Scene, centres: np.ndarray, samples: int) -> np.ndarray:
    steps = (np.arange(samples) + 0.5) / samples - 0.5
    total = np.zeros((len(centres), 3))
    for offset in np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2):
        total += scene.colours(centres + offset)
    return total / samples**2


def _spiral(count: int) -> np.ndarray:
    """Returns `count` points spread evenly over the unit disc."""
    index = np.arange(count)
    angle, radius = 2.399963 * index, np.sqrt((index + 0.5) / max(count, 1))
    if count == 1:
        radius = np.zeros(1)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
