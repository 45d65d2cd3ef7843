"""A pinhole camera: from pixels to rays in the world, and from points to pixels.

Geometry as in R. Hartley and A. Zisserman, Multiple View Geometry in Computer Vision,
2nd edition, 2004, chapter 6; angles as in MuJoCo's viewer.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

NEAR_M = 1e-3


@dataclass(frozen=True)
class Camera:
    """A pinhole camera that looks at a point, described as in MuJoCo's viewer.

    Attributes:
        lookat_w: the point in the middle of the picture [m].
        distance_m: from the camera to `lookat_w`.
        azimuth_deg: heading of the view; 0 looks along world +x, 90 along +y.
        elevation_deg: pitch of the view; negative looks down.
        fovy_deg: full vertical field of view.
    """

    lookat_w: tuple[float, float, float] = (0.0, 0.0, 0.05)
    distance_m: float = 0.55
    azimuth_deg: float = 140.0
    elevation_deg: float = -22.0
    fovy_deg: float = 35.0


def axes(camera: Camera) -> Float[np.ndarray, "3 3"]:
    """Returns the unit vectors right r, up u and forward f of the camera as rows [1].

    f = (cos e cos a, cos e sin a, sin e), r = (sin a, −cos a, 0), u = r × f, with
    azimuth a and elevation e.

    Source:
        MuJoCo's viewer, for the meaning of a and e.
    """
    azimuth, elevation = np.radians((camera.azimuth_deg, camera.elevation_deg))
    flat = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    up_w = np.array([0.0, 0.0, 1.0])
    forward = np.cos(elevation) * flat + np.sin(elevation) * up_w
    right = np.array([np.sin(azimuth), -np.cos(azimuth), 0.0])
    return np.stack([right, np.cross(right, forward), forward])


def position(camera: Camera) -> Float[np.ndarray, "3"]:
    """Returns the point from which all rays start [m]: p = lookat − distance · f.

    Source:
        MuJoCo's viewer.
    """
    return np.asarray(camera.lookat_w) - camera.distance_m * axes(camera)[2]


def focal_px(camera: Camera, height: int) -> float:
    """Returns the focal length in pixels: (h / 2) / tan(fovy / 2)."""
    return height / 2 / np.tan(np.radians(camera.fovy_deg) / 2)


def pixel_centres(size: tuple[int, int]) -> Float[np.ndarray, "pixels 2"]:
    """Returns the centres of all pixels, row by row: (u, v) = (i + ½, j + ½) [1].

    u counts pixels to the right and v down, from the top left corner.

    Source:
        Ours; corners of the picture are whole numbers.
    """
    width, height = size
    grid = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    return np.stack(grid, axis=-1).reshape(-1, 2)


def rays(
    camera: Camera, size: tuple[int, int], points_px: Float[np.ndarray, "n 2"]
) -> Float[np.ndarray, "n 3"]:
    """Returns the unit direction in the world of the ray through each image point [1].

    d = f + (u − w / 2) / F · r − (v − h / 2) / F · u, normalized, F in pixels.

    Args:
        camera: where the rays start and what they see.
        size: width and height of the picture in pixels.
        points_px: image points, u to the right and v down from the top left corner.

    Source:
        Hartley and Zisserman 2004, section 6.1.
    """
    offset = (points_px - np.asarray(size) / 2) / focal_px(camera, size[1])
    right, up, forward = axes(camera)
    along = forward + offset[:, :1] * right - offset[:, 1:] * up
    return along / np.linalg.norm(along, axis=1, keepdims=True)


def project(
    camera: Camera, size: tuple[int, int], points_w: Float[np.ndarray, "n 3"]
) -> tuple[Float[np.ndarray, "n 2"], Float[np.ndarray, " n"]]:
    """Returns where points of the world appear in the picture, and how deep [m].

    (u, v) = (w / 2, h / 2) + F (x, −y) / z in the camera's axes, the inverse of `rays`.
    Depth z is measured along the optical axis; a point whose depth is not above
    `NEAR_M` lies behind the camera and gets NaN pixels.

    Source:
        Hartley and Zisserman 2004, section 6.1.
    """
    local = (np.asarray(points_w, float) - position(camera)) @ axes(camera).T
    depth = local[:, 2]
    scale = focal_px(camera, size[1]) / np.where(depth > NEAR_M, depth, np.nan)
    centre = np.asarray(size) / 2
    return centre + local[:, :2] * [1.0, -1.0] * scale[:, None], depth
