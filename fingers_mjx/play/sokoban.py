"""Sokoban: two levels, and what a key press does to them.

The levels are our own. Characters of a level: `#` wall, `@` player, `$` box, `.` goal,
space floor; rows from top to bottom.
"""

from dataclasses import dataclass, replace

Cell = tuple[int, int]

MOVES: dict[str, Cell] = {
    "up": (-1, 0),
    "down": (1, 0),
    "left": (0, -1),
    "right": (0, 1),
}
"""Arrow key -> step (row, column)."""

ONE_BOX = """\
#######
# @ ###
#    .#
#  $# #
##  # #
#######"""
"""One box; the shortest solution has 9 moves."""

TWO_BOXES = """\
#######
#.#  ##
# $ $ #
#   . #
#@ # ##
#######"""
"""Two boxes; the shortest solution has 12 moves."""

LEVELS = {"one-box": ONE_BOX, "two-boxes": TWO_BOXES}

SOLUTIONS: dict[str, tuple[str, ...]] = {
    ONE_BOX: (
        *("down", "down", "down", "right", "up"),
        *("left", "up", "right", "right"),
    ),
    TWO_BOXES: (
        *("up", "right", "right", "up", "up", "right"),
        *("down", "left", "left", "down", "left", "up"),
    ),
}
"""A shortest solution of each level."""


@dataclass(frozen=True)
class Board:
    """A position of the game; cells are (row, column).

    Attributes:
        size: rows and columns.
        walls, goals, boxes: occupied cells.
        player: where the player stands.
    """

    size: tuple[int, int]
    walls: frozenset[Cell]
    goals: frozenset[Cell]
    boxes: frozenset[Cell]
    player: Cell

    @property
    def solved(self) -> bool:
        """Every box is on a goal."""
        return self.boxes == self.goals


def read_level(text: str) -> Board:
    """Reads a level.

    Args:
        text: rows of the level, see the module.

    Raises:
        ValueError: an unknown character, not one player, or not as many goals as boxes.
    """
    rows = text.splitlines()
    at = {(r, c): x for r, row in enumerate(rows) for c, x in enumerate(row)}
    if unknown := set(at.values()) - set("#@$. "):
        raise ValueError(f"unknown characters in a level: {sorted(unknown)}")

    def cells(kind: str) -> frozenset[Cell]:
        return frozenset(cell for cell, x in at.items() if x == kind)

    players, boxes, goals = cells("@"), cells("$"), cells(".")
    if len(players) != 1 or len(boxes) != len(goals):
        raise ValueError("a level has one player and as many goals as boxes")
    size = (len(rows), max(map(len, rows)))
    return Board(size, cells("#"), goals, boxes, next(iter(players)))


def move(board: Board, key: str) -> Board:
    """Returns the board after an arrow key; a step that is blocked changes nothing.

    The player pushes one box if the cell behind it is free, and never pulls. Keys that
    are not arrows do nothing.
    """
    if key not in MOVES:
        return board
    ahead = _step(board.player, key)
    if ahead in board.walls:
        return board
    if ahead not in board.boxes:
        return replace(board, player=ahead)
    behind = _step(ahead, key)
    if behind in board.walls | board.boxes:
        return board
    boxes = board.boxes - {ahead} | {behind}
    return replace(board, player=ahead, boxes=boxes)


def _step(cell: Cell, key: str) -> Cell:
    row, column = MOVES[key]
    return cell[0] + row, cell[1] + column
