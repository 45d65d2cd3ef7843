"""Capsules and bounds from the colliding geoms of a user's link: meshes or primitives.

A capsule lies along the longest principal axis of the geoms' convex hull; its radius is
the mean of the half widths along and across the hinge, its ends reach as far as the
geoms do. A link that has a capsule already keeps it.
"""

from collections.abc import Iterable

import mujoco
import numpy as np
from jaxtyping import Float
from scipy.spatial import ConvexHull, QhullError

from envs.hand.importing.palm import Frame
from envs.hand.nominal import Capsule

_GEOM = mujoco.mjtGeom
_SHORTEST_M = 0.001
_DISTINCT = 1.1
"""How much longer than wide a shape must be for its own axis to be used."""


def colliding_geoms(model: mujoco.MjModel, bodies: Iterable[int]) -> list[int]:
    """Returns the solid geoms that touch others, of some bodies."""
    solid = (_GEOM.mjGEOM_SPHERE, _GEOM.mjGEOM_CAPSULE, _GEOM.mjGEOM_ELLIPSOID)
    solid += (_GEOM.mjGEOM_CYLINDER, _GEOM.mjGEOM_BOX, _GEOM.mjGEOM_MESH)
    touches = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
    there = np.isin(model.geom_bodyid, list(bodies)) & touches
    return np.flatnonzero(there & np.isin(model.geom_type, solid)).tolist()


def bounds(
    points: Float[np.ndarray, "n 3"],
) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]:
    """Bounds of points: low = min_i x_i, high = max_i x_i, by coordinate [m].

    Source:
        Ours: an axis-aligned box.
    """
    return points.min(axis=0), points.max(axis=0)


def surface_points(
    model: mujoco.MjModel, data: mujoco.MjData, geoms: list[int], frame: Frame
) -> Float[np.ndarray, "n 3"]:
    """Points on the hulls of geoms: x = Rᵀ (p + R_g x_g − o) [m].

    Args:
        model: the user's.
        data: its pose.
        geoms: p and R_g are their poses; primitives are sampled, meshes give vertices.
        frame: (o, R), given in the world.

    Source:
        Ours.
    """
    points = [
        data.geom_xpos[geom]
        + _points(model, geom) @ data.geom_xmat[geom].reshape(3, 3).T
        for geom in geoms
    ]
    return (np.concatenate(points) - frame.pos) @ frame.mat


def link_capsule(
    model: mujoco.MjModel, data: mujoco.MjData, geoms: list[int], frame: Frame
) -> Capsule:
    """Returns a capsule in the place of a link's geoms, its end away from the hinge.

    Args:
        model: the user's.
        data: its pose.
        geoms: colliding geoms of the link; at least one.
        frame: of the link in the world, +y along the hinge.
    """
    kept = _own_capsule(model, data, geoms, frame)
    if kept is not None:
        start, end, radius = kept
    else:
        start, end, radius = _around(surface_points(model, data, geoms, frame))
    if np.linalg.norm(end) < np.linalg.norm(start):
        start, end = end, start
    return _triple(start), _triple(end), rounded(radius)


def _own_capsule(
    model: mujoco.MjModel, data: mujoco.MjData, geoms: list[int], frame: Frame
) -> tuple[np.ndarray, np.ndarray, float] | None:
    """The one capsule among geoms that else are spheres at its ends, if it is so."""
    capsules = [g for g in geoms if model.geom_type[g] == _GEOM.mjGEOM_CAPSULE]
    if len(capsules) != 1:
        return None
    radius, half = model.geom_size[capsules[0], :2]
    along = half * data.geom_xmat[capsules[0]].reshape(3, 3)[:, 2]
    ends = data.geom_xpos[capsules[0]] + np.stack([-along, along])
    for geom in set(geoms) - set(capsules):
        away = np.linalg.norm(ends - data.geom_xpos[geom], axis=1).min()
        sphere = model.geom_type[geom] == _GEOM.mjGEOM_SPHERE
        if not sphere or away + model.geom_size[geom, 0] > 1.001 * radius:
            return None
    start, end = (ends - frame.pos) @ frame.mat
    return start, end, float(radius)


def _around(
    points: Float[np.ndarray, "n 3"],
) -> tuple[np.ndarray, np.ndarray, float]:
    """Capsule about points in the frame of a link, see the module."""
    axis = _long_axis(points)
    side = np.array([0.0, 1.0, 0.0]) - axis[1] * axis
    if np.linalg.norm(side) < 0.1:  # the link lies along its hinge
        side = np.array([1.0, 0.0, 0.0]) - axis[0] * axis
    side = side / np.linalg.norm(side)
    axes = np.stack([np.cross(side, axis), side, axis])
    low, high = bounds(points @ axes.T)
    radius = float(np.mean(high[:2] - low[:2]) / 2)
    middle = (low + high) / 2
    half = max((high[2] - low[2]) / 2 - radius, _SHORTEST_M / 2)
    start, end = (np.add(middle, (0, 0, z)) for z in (-half, half))
    return start @ axes, end @ axes, radius


def _long_axis(points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "3"]:
    """Longest principal axis of the hull; towards the middle for one without any."""
    values, vectors = np.linalg.eigh(_hull_moments(points))
    if values[2] > _DISTINCT**2 * values[1]:
        return vectors[:, 2]
    middle = np.mean(bounds(points), axis=0)
    length = np.linalg.norm(middle)
    return middle / length if length > _SHORTEST_M else np.array([0.0, 0.0, 1.0])


def _hull_moments(points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "3 3"]:
    """Second moments ∫ x xᵀ dV / V of the convex hull about its centre [m²].

    The hull is cut into tetrahedra that meet in its middle. One with corners 0, v₁, v₂,
    v₃ and volume V has ∫ x xᵀ dV = V/20 (Σ vᵢvᵢᵀ + s sᵀ), s = Σ vᵢ.
    """
    points = points - points.mean(axis=0)
    try:
        hull = ConvexHull(points)
    except QhullError:  # flat
        return points.T @ points / len(points)
    corners = points[hull.simplices]
    volume = np.abs(np.linalg.det(corners)) / 6
    total = corners.sum(axis=1)
    squares = np.einsum("nki,nkj->nij", corners, corners)
    squares += np.einsum("ni,nj->nij", total, total)
    centre = volume @ total / 4 / volume.sum()
    second = np.einsum("n,nij->ij", volume, squares) / 20 / volume.sum()
    return second - np.outer(centre, centre)


def _points(model: mujoco.MjModel, geom: int) -> Float[np.ndarray, "n 3"]:
    """Points on the hull of a geom, in its own frame [m]."""
    kind, size = model.geom_type[geom], model.geom_size[geom]
    if kind == _GEOM.mjGEOM_MESH:
        mesh = model.geom_dataid[geom]
        first = model.mesh_vertadr[mesh]
        vertices = model.mesh_vert[first : first + model.mesh_vertnum[mesh]]
        return vertices.astype(float)
    if kind == _GEOM.mjGEOM_BOX:
        return size * np.array(list(np.ndindex(2, 2, 2))) * 2 - size
    if kind == _GEOM.mjGEOM_CYLINDER:
        ring = _sphere()[_sphere()[:, 2] == 0.0] * [size[0], size[0], 1.0]
        return np.concatenate([np.add(ring, (0, 0, z)) for z in (-size[1], size[1])])
    if kind == _GEOM.mjGEOM_ELLIPSOID:
        return _sphere() * size
    half = size[1] if kind == _GEOM.mjGEOM_CAPSULE else 0.0
    ball = _sphere() * size[0]
    return np.concatenate([np.add(ball, (0, 0, z)) for z in (-half, half)])


def _sphere() -> Float[np.ndarray, "n 3"]:
    """Points on the unit sphere, with its poles and its equator."""
    turn = np.linspace(0.0, 2 * np.pi, 48, endpoint=False)
    up = np.sin(np.linspace(-np.pi / 2, np.pi / 2, 13))
    up[6] = 0.0
    wide = np.sqrt(1.0 - up**2)
    rings = np.stack([np.outer(wide, np.cos(turn)), np.outer(wide, np.sin(turn))], -1)
    height = np.broadcast_to(up[:, None, None], (*rings.shape[:2], 1))
    return np.concatenate([rings, height], axis=-1).reshape(-1, 3)


def rounded(value: float) -> float:
    """Returns a number as a hand file keeps it, to 12 digits."""
    return float(f"{value:.12g}")


def _triple(values: np.ndarray) -> tuple[float, float, float]:
    x, y, z = (rounded(value) for value in values)
    return x, y, z
