"""Keys pressed in the closed loop, and the boards that they move."""

import argparse
import dataclasses
from types import SimpleNamespace
from typing import Any

import jax
import numpy as np
import pytest
from support.cli_setup import TRAIN, make_bundle, random_weights
from support.keyboard_rig import Rig

from envs.errors import InputError
from envs.tasks.keyboard.model import KEY_NAMES
from envs.tasks.keyboard.stance import JOINTS
from fingers_deploy import load_bundle
from fingers_mjx.cli.play_keys import key_times, keys_asked, start_board
from fingers_mjx.evaluation.setups import nominal
from fingers_mjx.play.episodes import play_episodes
from fingers_mjx.play.keyboard import KeyPlayer, KeysPlayed, boards_of, keys_story
from fingers_mjx.play.keyboard_video import write_keyboard_video
from fingers_mjx.play.sokoban import ONE_BOX, SOLUTIONS, TWO_BOXES, read_level
from fingers_mjx.play.sokoban_board import draw_panel
from fingers_mjx.play.video import Film
from fingers_mjx.runs.setup import make_env, new_setup
from fingers_robot.behaviour.keyboard.keys import ARROWS, KeyOutcome, KeyTimes

START = read_level(ONE_BOX)
SOLUTION = SOLUTIONS[ONE_BOX]


def trace_of(steps):
    """A trace in which these keys go down, a tuple for each step."""
    flags = [[float(name in names) for name in KEY_NAMES] for names in steps]
    return SimpleNamespace(extra={"key_pressed": np.array(flags)})


def test_boards_follow_the_keys_that_went_down():
    pauses = [step for key in SOLUTION for step in ((), (key,), ())]
    boards: Any = boards_of(trace_of(pauses), START)  # pyright: ignore
    assert len(boards) == len(pauses)
    assert boards[-1].solved and not boards[-3].solved
    assert boards[0] == START and boards[1] == boards[2] != START
    wrong = boards_of(trace_of([("enter",), ("right_shift",)]), START)  # pyright: ignore
    assert wrong == [START, START]


def test_a_key_too_many_counts_on_the_board():
    outcomes = tuple(KeyOutcome(key, key, 0.2) for key in SOLUTION)
    clean = KeysPlayed(outcomes, SOLUTION, True)
    stray = KeysPlayed(outcomes, (*SOLUTION[:2], "left", *SOLUTION[2:]), True)
    assert clean.board(START).solved and not stray.board(START).solved
    text = keys_story([clean, stray], START)
    assert "18 of 18 keys correct" in text and "solved in 1 of 2" in text
    late = KeysPlayed((KeyOutcome("up", "", 1.5),), (), True)
    assert keys_story([late], None) == "0 of 1 keys correct"


def test_the_panel_shows_box_player_and_keys():
    size = (160, 200)
    plain = draw_panel(START, "", (), size)
    assert plain.shape == (200, 160, 3)
    for other in (
        draw_panel(None, "", (), size),
        draw_panel(read_level(TWO_BOXES), "", (), size),
        draw_panel(START, "up", (), size),
        draw_panel(START, "", ("up",), size),
    ):
        assert (other != plain).any()


def options(**given):
    return argparse.Namespace(**{"keys": None, "level": None, "retries": 0} | given)


def of_task(name) -> Any:
    return SimpleNamespace(manifest=SimpleNamespace(task=name))


def test_options_name_keys_or_a_level():
    bundle = of_task("keyboard")
    assert keys_asked(options(), bundle) is None
    assert keys_asked(options(keys="up, left"), bundle) == ("up", "left")
    assert keys_asked(options(level="two-boxes"), bundle) == SOLUTIONS[TWO_BOXES]
    board = start_board(options(level="one-box"))
    assert board == START and start_board(options()) is None


@pytest.mark.parametrize(
    ("given", "task", "sentence"),
    [
        ({"keys": "up,uo"}, "keyboard", r"--keys: found uo; valid: one of left, down"),
        ({"keys": ""}, "keyboard", r"--keys: found nothing; valid: one of left"),
        ({"keys": "up", "level": "one-box"}, "keyboard", "either --keys or --level"),
        ({"level": "one-box"}, "crawl", r"--level: found crawl; valid: a keyboard"),
    ],
)
def test_what_cannot_be_pressed_is_refused(given, task, sentence):
    with pytest.raises(InputError, match=sentence):
        keys_asked(options(**given), of_task(task))


DEEPER = 1.2
"""Share of the way down: 2 mm more, since a key that is just closed opens by itself."""


class Scripted:
    """In the place of a policy: joint targets from inverse kinematics."""

    def __init__(self, bundle):
        self.bundle, self.rig, self.faults = bundle, Rig(), 0
        self.action = np.zeros(20, np.float32)

    def reset(self, target):
        self.target, self.last, self.idle = np.array(target, float), None, 99

    def step(self, joint_pos, gravity, angvel, inputs):
        goal, asked = self.rig.rest.copy(), np.flatnonzero(inputs[:4])
        self.idle = 0 if len(asked) else self.idle + 1
        if len(asked):
            self.last = ARROWS[asked[0]]
            above, press = (x[self.last] for x in (self.rig.above, self.rig.goals))
            goal[JOINTS] = above + DEEPER * (press - above)
        elif self.idle < 10 and self.last:
            goal[JOINTS] = self.rig.above[self.last]
        self.target += np.clip(goal - self.target, -0.028, 0.028)
        return self.target.astype(np.float32)


@pytest.fixture(scope="module")
def setup():
    return nominal(new_setup(dataclasses.replace(TRAIN, task="keyboard"), None))


@pytest.fixture(scope="module")
def player(setup, tmp_path_factory):
    path = tmp_path_factory.mktemp("keys") / "bundle"
    weights = random_weights(clip=setup.env.action_clip, gain=0.0, inputs=424)
    bundle = load_bundle(make_bundle(path, setup, weights))
    times = key_times(options(), setup.env)
    assert times == KeyTimes(idle_s=0.75, timeout_s=1.5, retries=0)
    player = KeyPlayer(make_env(setup, 1, "cpu"), bundle, SOLUTION, times)
    player.controller = Scripted(bundle)  # pyright: ignore
    return player


@pytest.mark.slow
def test_a_level_is_solved_by_simulated_key_strokes(player, tmp_path):
    session = play_episodes(player, 1, round(12.0 / player.env.dt))
    (result,) = player.results
    assert result.complete and result.pressed == SOLUTION
    assert all(outcome.correct for outcome in result.outcomes)
    assert result.board(START).solved
    columns = session.table.columns
    assert columns["requests"] == 9 and columns["correct_fraction"] == 1.0
    reported = [outcome.latency_s for outcome in result.outcomes]
    assert columns["latency_median_s"] == pytest.approx(np.median(reported), abs=1e-3)
    assert boards_of(session.first.trace, START)[-1].solved

    film = Film(tmp_path / "level.webp", 1.0, 128, lambda *_: None)
    write_keyboard_video(film, player.env, session.first, START)
    assert film.path.stat().st_size > 1000


@pytest.mark.slow
def test_a_hand_that_does_not_press_runs_into_time_outs(player):
    player.results.clear()
    player.keys, player.times = ("up", "left"), KeyTimes(0.2, 0.4, retries=1)
    player.controller.rig.goals = player.controller.rig.above
    player.play(jax.random.key(1), 200)
    (result,) = player.results
    assert result.complete and result.pressed == ()
    assert [outcome.asked for outcome in result.outcomes] == ["up"] * 2 + ["left"] * 2
