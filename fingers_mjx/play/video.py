"""Video of a played episode: ray-cast, with a camera that follows the hand."""

from collections.abc import Callable, Iterator
from pathlib import Path

import mujoco
import numpy as np
from jaxtyping import Float

from fingers_mjx.pictures.camera import Camera
from fingers_mjx.pictures.overlay import caption
from fingers_mjx.pictures.video import Frame, follow, frames, write_animation, write_mp4
from fingers_mjx.play.player import Played
from fingers_mjx.play.target import Target, target_of, with_target

VIDEO_SUFFIXES = (".mp4", ".webp", ".gif")
ASPECT = 9 / 16
AHEAD_M = 0.06
"""From the palm's origin to the middle of the hand."""


def write_video(
    path: Path,
    model: mujoco.MjModel,
    played: Played,
    dt_s: float,
    fps: float,
    width: int,
    progress: Callable[[int, int], None],
) -> Path:
    """Writes a film of an episode.

    Args:
        path: file to write, with one of `VIDEO_SUFFIXES`.
        model: the scene.
        played: the episode.
        dt_s: control interval.
        fps: frames per second.
        width: of the picture; its height is 9/16 of that.
        progress: told (frames drawn, frames in all).
    """
    steps = frame_steps(len(played.qpos), dt_s, fps)
    qpos = played.qpos[steps]
    cameras = follow(_view(qpos[0], target_of(played)), qpos[:, :3], fps)
    size = (width, 2 * round(width * ASPECT / 2))
    pictures = frames(model, qpos, cameras, size)
    marked = with_target(pictures, cameras, target_of(played))
    texts = [_text(played, step, dt_s) for step in steps]
    write = write_mp4 if path.suffix == ".mp4" else write_animation
    return write(path, _captioned(marked, texts, progress), fps)


def frame_steps(poses: int, dt_s: float, fps: float) -> np.ndarray:
    """Returns the pose nearest in time to each frame."""
    count = max(1, round((poses - 1) * dt_s * fps))
    steps = np.rint(np.arange(count) / (fps * dt_s)).astype(int)
    return np.minimum(steps, poses - 1)


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


def _captioned(
    pictures: Iterator[Frame],
    texts: list[str],
    progress: Callable[[int, int], None],
) -> Iterator[Frame]:
    for index, (picture, text) in enumerate(zip(pictures, texts, strict=True)):
        yield caption(picture, text)
        progress(index + 1, len(texts))


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
