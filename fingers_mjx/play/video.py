"""Video of a played episode: ray-cast, with a camera that follows the hand."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from envs.batch import BatchEnv
from envs.tasks.push.measures import STAY_M
from fingers_mjx.pictures.camera import Camera
from fingers_mjx.pictures.overlay import Line, caption, draw
from fingers_mjx.pictures.video import Frame, follow, frames, write_animation, write_mp4
from fingers_mjx.play.player import Played
from rewards.pushing import DELIVERED_M

ASPECT = 9 / 16
AHEAD_M = 0.06
"""From the palm's origin to the middle of the hand."""
ABOVE_FLOOR_M = 0.001
RINGS = ((DELIVERED_M, (200, 60, 30)), (STAY_M, (120, 120, 120)))
"""Around a target: within them a delivery ends, and stays."""

Target = Float[np.ndarray, "2"] | None


@dataclass(frozen=True)
class Film:
    """How an episode is filmed.

    Attributes:
        path: file to write: .mp4, or an animation, .webp or .gif.
        fps: frames per second.
        width: of the picture; its height is 9/16 of that.
        progress: called with (frames drawn, frames in all).
        drawn_by: out of `fingers_mjx.pictures.renderer.RENDERERS`.
    """

    path: Path
    fps: float
    width: int
    progress: Callable[[int, int], None]
    drawn_by: str = "auto"

    @property
    def height(self) -> int:
        """Rows of the picture, an even number."""
        return 2 * round(self.width * ASPECT / 2)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels."""
        return self.width, self.height

    def write(self, pictures: Iterator[Frame], count: int) -> Path:
        """Writes `count` pictures and reports the progress."""
        write = write_mp4 if self.path.suffix == ".mp4" else write_animation
        return write(self.path, self._counted(pictures, count), self.fps)

    def _counted(self, pictures: Iterator[Frame], count: int) -> Iterator[Frame]:
        for number, picture in enumerate(pictures, 1):
            yield picture
            self.progress(number, count)


def write_video(film: Film, env: BatchEnv, played: Played) -> Path:
    """Writes an episode, seen from a camera that follows the hand.

    Args:
        film: where, how fast and how large.
        env: of the scene and the control interval.
        played: the episode.
    """
    steps = frame_steps(len(played.qpos), env.dt, film.fps)
    qpos, target_w = played.qpos[steps], _target(played)
    cameras = follow(_view(qpos[0], target_w), qpos[:, :3], film.fps)
    pictures = frames(env.mj_model, qpos, cameras, film.size, film.drawn_by)
    if target_w is not None:
        rings = [_ring(target_w, *ring) for ring in RINGS]
        pictures = (draw(p, c, rings) for p, c in zip(pictures, cameras, strict=True))
    texts = [_text(played, step, env.dt) for step in steps]
    return film.write(map(caption, pictures, texts), len(texts))


def frame_steps(poses: int, dt_s: float, fps: float) -> np.ndarray:
    """Returns the pose nearest in time to each frame."""
    count = max(1, round((poses - 1) * dt_s * fps))
    steps = np.rint(np.arange(count) / (fps * dt_s)).astype(int)
    return np.minimum(steps, poses - 1)


def _target(played: Played) -> Target:
    """Returns where the object is to go [m], None in tasks without a target."""
    found = played.trace.extra.get("target_w")
    return None if found is None else np.asarray(found[0])


def _ring(target_w: np.ndarray, radius_m: float, colour: tuple[int, int, int]) -> Line:
    angle = np.linspace(0.0, 2 * np.pi, 49)
    x = target_w[0] + radius_m * np.cos(angle)
    y = target_w[1] + radius_m * np.sin(angle)
    points_w = np.stack([x, y, np.full_like(x, ABOVE_FLOOR_M)], axis=1)
    return Line(points_w, colour, 1.5, 0.8)


def _view(qpos: Float[np.ndarray, " nq"], target_w: Target) -> Camera:
    """Returns a view from the front left of where the hand points.

    Where there is a target, it is from farther away, more ahead and above: the fingers
    do not hide what they push.
    """
    w, x, y, z = qpos[3:7]
    # The fingers point along the palm's z.
    heading = np.arctan2(2 * (y * z - w * x), 2 * (x * z + w * y))
    ahead = AHEAD_M * np.array([np.cos(heading), np.sin(heading)])
    return Camera(
        lookat_w=(float(ahead[0]), float(ahead[1]), 0.06),
        distance_m=0.45 if target_w is None else 0.75,
        azimuth_deg=float(np.degrees(heading)) + (248.0 if target_w is None else 205.0),
        elevation_deg=-18.0 if target_w is None else -32.0,
    )


def _text(played: Played, step: int, dt_s: float) -> str:
    """Returns time and command of a pose, or how far a recovery has come."""
    row = min(step, len(played.trace.command) - 1)
    x, y, turn = played.trace.command[row]
    words = f"command: forward {x:+.2f} m/s, left {y:+.2f} m/s, turn {turn:+.2f} rad/s"
    if "target_error_m" in played.trace.extra:
        error_m = played.trace.extra["target_error_m"][row]
        words = f"cube {100 * error_m:.1f} cm from its target"
    if "settling" in played.trace.extra and not np.any((x, y, turn)):
        words = _stage(played, row)
    return f"{step * dt_s:4.1f} s   {words}"


def _stage(played: Played, row: int) -> str:
    """Returns how far a recovery has come."""
    now = {name: values[row] for name, values in played.trace.extra.items()}
    if not now["settling"]:
        return f"getting up, tilt {np.degrees(now['tilt_rad_v']):.0f} deg"
    return "in the stance" if now["settled"] else "upright: settling into the stance"
