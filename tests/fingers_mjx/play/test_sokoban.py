"""Sokoban: the rules, and a proof that the stored solutions are the shortest."""

from collections import deque
from functools import reduce

import pytest

from fingers_mjx.play.sokoban import (
    MOVES,
    ONE_BOX,
    SOLUTIONS,
    TWO_BOXES,
    move,
    read_level,
)


def shortest(board):
    """Length of the shortest solution: a breadth-first search over all positions."""
    queue, seen = deque([(board, 0)]), {(board.player, board.boxes)}
    while queue:
        board, moves = queue.popleft()
        if board.solved:
            return moves
        for key in MOVES:
            after = move(board, key)
            if (after.player, after.boxes) not in seen:
                seen.add((after.player, after.boxes))
                queue.append((after, moves + 1))
    return None


@pytest.mark.parametrize(
    ("level", "boxes", "moves"), [(ONE_BOX, 1, 9), (TWO_BOXES, 2, 12)]
)
def test_the_stored_solution_is_the_shortest(level, boxes, moves):
    board = read_level(level)
    assert len(board.boxes) == boxes
    solution = SOLUTIONS[level]
    assert len(solution) == moves == shortest(board)
    assert reduce(move, solution, board).solved
    assert set(solution) == set(MOVES)  # every arrow key is needed
    for count in range(moves):
        assert not reduce(move, solution[:count], board).solved


def test_a_level_without_a_way_has_no_solution():
    assert shortest(read_level("####\n#@.#\n#$ #\n####")) is None


def test_the_rules():
    board = read_level("######\n#@$ .#\n######")
    pushed = move(board, "right")
    assert pushed.player == (1, 2) and pushed.boxes == {(1, 3)}
    assert move(board, "left") == move(board, "up") == board  # walls
    assert move(pushed, "left").boxes == pushed.boxes  # boxes are not pulled
    done = move(pushed, "right")
    assert done.solved and not pushed.solved
    assert move(done, "right") == done  # a box against the wall
    assert move(board, "right_shift") == board
    two = read_level("#######\n#@$$..#\n#######")
    assert move(two, "right") == two  # two boxes in a row


@pytest.mark.parametrize("text", ["#@x#", "# #", "@@", "@$$.", "@."])
def test_a_broken_level_is_refused(text):
    with pytest.raises(ValueError, match="level"):
        read_level(text)
