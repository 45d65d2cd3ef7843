"""Picture of a Sokoban position, and of the arrow keys beside it."""

from collections.abc import Collection

import numpy as np
from jaxtyping import UInt8
from PIL import Image, ImageDraw

from fingers_mjx.play.sokoban import Board

Rgb = tuple[int, int, int]
PAPER: Rgb = (246, 246, 243)
WALL, FLOOR, GOAL = (92, 98, 108), (226, 226, 220), (213, 94, 0)
BOX, BOX_HOME, PLAYER = (230, 159, 0), (0, 158, 115), (0, 114, 178)
KEY, ASKED, DOWN = (205, 206, 208), (86, 180, 233), (0, 114, 178)
SMOOTH = 2

# Columns and rows of the arrow keys, and their arrow heads in a unit square.
_KEYS = {"left": (0, 1), "down": (1, 1), "right": (2, 1), "up": (1, 0)}
_HEADS = {
    "left": ((0.65, 0.3), (0.65, 0.7), (0.3, 0.5)),
    "right": ((0.35, 0.3), (0.35, 0.7), (0.7, 0.5)),
    "up": ((0.3, 0.65), (0.7, 0.65), (0.5, 0.3)),
    "down": ((0.3, 0.35), (0.7, 0.35), (0.5, 0.7)),
}


def draw_panel(
    board: Board | None, asked: str, down: Collection[str], size: tuple[int, int]
) -> UInt8[np.ndarray, "h w 3"]:
    """Draws the board above the arrow keys.

    Args:
        board: position; None draws the keys alone.
        asked: the requested key, empty between requests.
        down: keys that are pressed.
        size: width and height in pixels.
    """
    wide = (size[0] * SMOOTH, size[1] * SMOOTH)
    picture = Image.new("RGB", wide, PAPER)
    pen = ImageDraw.Draw(picture)
    upper = round(wide[1] * 0.64)
    if board is not None:
        _draw_board(pen, board, (0, 0, wide[0], upper))
    _draw_keys(pen, asked, down, (0, upper, wide[0], wide[1]))
    return np.asarray(picture.resize(size, Image.Resampling.BOX)).copy()


def _draw_board(
    pen: ImageDraw.ImageDraw, board: Board, area: tuple[int, int, int, int]
) -> None:
    rows, columns = board.size
    cell = 0.9 * min((area[2] - area[0]) / columns, (area[3] - area[1]) / rows)
    x0 = (area[0] + area[2] - columns * cell) / 2
    y0 = (area[1] + area[3] - rows * cell) / 2
    for row in range(rows):
        for column in range(columns):
            place = (row, column)
            x, y = x0 + column * cell, y0 + row * cell
            ground = WALL if place in board.walls else FLOOR
            pen.rectangle(_box(x, y, cell, 0.02), fill=ground)
            if place in board.goals:
                pen.ellipse(_box(x, y, cell, 0.36), fill=GOAL)
            if place in board.boxes:
                colour = BOX_HOME if place in board.goals else BOX
                pen.rectangle(_box(x, y, cell, 0.14), fill=colour)
            if place == board.player:
                pen.ellipse(_box(x, y, cell, 0.2), fill=PLAYER)


def _draw_keys(
    pen: ImageDraw.ImageDraw,
    asked: str,
    down: Collection[str],
    area: tuple[int, int, int, int],
) -> None:
    cell = 0.85 * min((area[2] - area[0]) / 3, (area[3] - area[1]) / 2)
    x0 = (area[0] + area[2] - 3 * cell) / 2
    y0 = (area[1] + area[3] - 2 * cell) / 2
    for name, (column, row) in _KEYS.items():
        x, y = x0 + column * cell, y0 + row * cell
        colour = DOWN if name in down else ASKED if name == asked else KEY
        pen.rounded_rectangle(_box(x, y, cell, 0.06), radius=0.12 * cell, fill=colour)
        head = [(x + u * cell, y + v * cell) for u, v in _HEADS[name]]
        pen.polygon(head, fill=(255, 255, 255))


def _box(
    x: float, y: float, cell: float, margin: float
) -> tuple[float, float, float, float]:
    """Returns the corners of a cell's inside."""
    inset = margin * cell
    return x + inset, y + inset, x + cell - inset, y + cell - inset
