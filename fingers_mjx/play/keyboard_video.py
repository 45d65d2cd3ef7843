"""Video of keys being pressed: the hand, and beside it the board that they move."""

from collections.abc import Callable, Iterator
from pathlib import Path

import mujoco
import numpy as np

from envs.tasks.keyboard.model import ARROWS, KEY_NAMES
from fingers_mjx.pictures.camera import Camera
from fingers_mjx.pictures.overlay import caption
from fingers_mjx.pictures.video import Frame, frames, write_animation, write_mp4
from fingers_mjx.play.keyboard import boards_of
from fingers_mjx.play.player import Played
from fingers_mjx.play.sokoban import Board
from fingers_mjx.play.sokoban_board import draw_panel
from fingers_mjx.play.video import frame_steps

VIEW = Camera(
    lookat_w=(0.11, 0.0, 0.05), distance_m=0.33, azimuth_deg=215.0, elevation_deg=-34.0
)
"""From beyond the keyboard, over it to the fingers."""

ASPECT, PANEL = 9 / 16, 0.34
"""Height of the film by its width; share of the width beside the hand."""


def write_keyboard_video(
    path: Path,
    model: mujoco.MjModel,
    played: Played,
    dt_s: float,
    fps: float,
    width: int,
    progress: Callable[[int, int], None],
    start: Board | None = None,
) -> Path:
    """Writes a film of an episode of the keyboard task.

    Args:
        path: file to write, with one of `fingers_mjx.play.video.VIDEO_SUFFIXES`.
        model: the scene.
        played: the episode.
        dt_s: control interval [s].
        fps: frames per second.
        width: of the picture; its height is 9/16 of that.
        progress: told (frames drawn, frames in all).
        start: board that the arrow keys move; without one the keys alone are drawn.
    """
    steps = frame_steps(len(played.qpos), dt_s, fps)
    height = 2 * round(width * ASPECT / 2)
    beside = 2 * round(width * PANEL / 2)
    pictures = frames(
        model, played.qpos[steps], [VIEW] * len(steps), (width - beside, height)
    )
    boards = None if start is None else [start, *boards_of(played.trace, start)]

    def film() -> Iterator[Frame]:
        for number, (step, picture) in enumerate(zip(steps, pictures, strict=True)):
            board = None if boards is None else boards[step]
            asked, down = _keys(played, step)
            panel = draw_panel(board, asked, down, (beside, height))
            text = f"{step * dt_s:4.1f} s   {'press ' + asked if asked else ''}"
            yield np.concatenate([caption(picture, text), panel], axis=1)
            progress(number + 1, len(steps))

    write = write_mp4 if path.suffix == ".mp4" else write_animation
    return write(path, film(), fps)


def _keys(played: Played, step: int) -> tuple[str, list[str]]:
    """Returns the requested key and those that are down in the pose after a step."""
    extra = {name: values[max(step - 1, 0)] for name, values in _of_keys(played)}
    asked = [name for name, x in zip(KEY_NAMES, extra["requested"], strict=True) if x]
    down = [name for name, x in zip(KEY_NAMES, extra["key_down"], strict=True) if x]
    return "".join(asked), [name for name in down if name in ARROWS]


def _of_keys(played: Played) -> Iterator[tuple[str, np.ndarray]]:
    for name in ("requested", "key_down"):
        yield name, np.asarray(played.trace.extra[name])
