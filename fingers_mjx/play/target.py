"""The target of a pushed object in a film: rings on the floor."""

from collections.abc import Iterator, Sequence

import numpy as np
from jaxtyping import Float

from envs.tasks.push.measures import STAY_M
from fingers_mjx.pictures.camera import Camera
from fingers_mjx.pictures.overlay import Line, draw
from fingers_mjx.pictures.video import Frame
from fingers_mjx.play.player import Played
from rewards.pushing import DELIVERED_M

Target = Float[np.ndarray, "2"] | None
_ABOVE_FLOOR_M = 0.001
_RINGS = ((DELIVERED_M, (200, 60, 30)), (STAY_M, (120, 120, 120)))


def target_of(played: Played) -> Target:
    """Returns where the object is to go [m], None in tasks without a target."""
    found = played.trace.extra.get("target_w")
    return None if found is None else np.asarray(found[0])


def with_target(
    pictures: Iterator[Frame], cameras: Sequence[Camera], target_w: Target
) -> Iterator[Frame]:
    """Draws a ring of 2 cm and one of 5 cm, within which a delivery ends and stays.

    Args:
        pictures: frames of a film.
        cameras: point of view of each.
        target_w: from `target_of`.
    """
    for picture, camera in zip(pictures, cameras, strict=True):
        if target_w is None:
            yield picture
        else:
            rings = [_ring(target_w, radius, colour) for radius, colour in _RINGS]
            yield draw(picture, camera, rings)


def _ring(target_w: np.ndarray, radius_m: float, colour: tuple[int, int, int]) -> Line:
    angle = np.linspace(0.0, 2 * np.pi, 49)
    x = target_w[0] + radius_m * np.cos(angle)
    y = target_w[1] + radius_m * np.sin(angle)
    points_w = np.stack([x, y, np.full_like(x, _ABOVE_FLOOR_M)], axis=1)
    return Line(points_w, colour, 1.5, 0.8)
