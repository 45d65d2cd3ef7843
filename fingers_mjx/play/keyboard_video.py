"""Video of keys being pressed: the hand, and beside it the board that they move."""

from pathlib import Path

import numpy as np

from envs.batch import BatchEnv
from envs.tasks.keyboard.model import ARROWS, KEY_NAMES
from fingers_mjx.pictures.camera import Camera
from fingers_mjx.pictures.overlay import caption
from fingers_mjx.pictures.video import Frame, frames
from fingers_mjx.play.keyboard import boards_of
from fingers_mjx.play.player import Played
from fingers_mjx.play.sokoban import Board
from fingers_mjx.play.sokoban_board import draw_panel
from fingers_mjx.play.video import Film, frame_steps

VIEW = Camera(
    lookat_w=(0.11, 0.0, 0.05), distance_m=0.33, azimuth_deg=215.0, elevation_deg=-34.0
)
"""From beyond the keyboard, over it to the fingers."""

PANEL = 0.34
"""Share of the width beside the hand."""


def write_keyboard_video(
    film: Film, env: BatchEnv, played: Played, start: Board | None = None
) -> Path:
    """Writes an episode of the keyboard task.

    Args:
        film: where, how fast and how large.
        env: of the scene and the control interval.
        played: the episode.
        start: board that the arrow keys move; without one the keys alone are drawn.
    """
    steps = frame_steps(len(played.qpos), env.dt, film.fps)
    beside = 2 * round(film.width * PANEL / 2)
    size, views = (film.width - beside, film.height), [VIEW] * len(steps)
    pictures = frames(env.mj_model, played.qpos[steps], views, size, film.drawn_by)
    boards = None if start is None else [start, *boards_of(played.trace, start)]

    def with_panel(step: int, picture: Frame) -> Frame:
        board = None if boards is None else boards[step]
        asked, down = _keys(played, step)
        panel = draw_panel(board, asked, down, (beside, film.height))
        text = f"{step * env.dt:4.1f} s   {'press ' + asked if asked else ''}"
        return np.concatenate([caption(picture, text), panel], axis=1)

    return film.write(map(with_panel, steps, pictures), len(steps))


def _keys(played: Played, step: int) -> tuple[str, list[str]]:
    """Returns the requested key and those that are down in the pose after a step."""
    row, extra = max(step - 1, 0), played.trace.extra
    asked, down = (
        [n for n, x in zip(KEY_NAMES, np.asarray(extra[k])[row], strict=True) if x]
        for k in ("requested", "key_down")
    )
    return "".join(asked), [name for name in down if name in ARROWS]
