"""The showing part of the demonstration: a given policy, measured and filmed."""

import sys
from dataclasses import dataclass
from pathlib import Path

from fingers_deploy import Bundle
from fingers_mjx.evaluation.evaluate import EpisodeTable
from fingers_mjx.evaluation.setups import nominal
from fingers_mjx.evaluation.source import document, evaluate_source, write_evaluation
from fingers_mjx.play.episodes import Session, play_episodes, schedule_of
from fingers_mjx.play.player import Player
from fingers_mjx.play.video import Film, write_video
from fingers_mjx.policy.source import PolicySource
from fingers_mjx.runs.setup import make_env
from fingers_mjx.training.counting import counting, timed

FILM = ((0.16, 0.0, 0.0), (0.10, 0.12, 0.0), (0.0, 0.0, 0.45), (0.16, 0.0, 0.0))
"""Commands of the video: ahead, to the left, turning, ahead."""


@dataclass(frozen=True)
class ShowSize:
    """How much is shown.

    Attributes:
        episodes: randomized episodes, in the environment and in C MuJoCo each.
        steps: control steps of each; as in training if None.
        film_s: length of the video [s].
        fps, width: of the video.
    """

    episodes: int = 16
    steps: int | None = None
    film_s: float = 12.0
    fps: float = 20.0
    width: int = 480


@dataclass(frozen=True)
class Shown:
    """What was found out about a policy.

    Attributes:
        source: policy.
        simulated: episodes in the environment.
        played: the same episodes in C MuJoCo through the shim.
        film: one episode of several commands, the nominal hand.
        video: mp4 of it.
    """

    source: PolicySource
    simulated: EpisodeTable
    played: Session
    film: Session
    video: Path


def show(out: Path, bundle: Bundle, source: PolicySource, size: ShowSize) -> Shown:
    """Evaluates, plays and films a policy.

    Args:
        out: directory for evaluation and video.
        bundle: the policy for the shim.
        source: the same for the environment.
        size: how much of everything.
    """
    with timed(f"1/5 {source.name} in {size.episodes} randomized episodes"):
        simulated = _evaluate(out, source, size)
    with timed("2/5 the same episodes in C MuJoCo, through the shim"):
        played = _play(bundle, source, size)
    with timed("3/5 a video of the nominal hand"):
        film, video = _film(out, bundle, source, size)
    return Shown(source, simulated, played, film, video)


def _evaluate(out: Path, source: PolicySource, size: ShowSize) -> EpisodeTable:
    with counting(sys.stdout, "evaluating", "steps") as count:
        table = evaluate_source(source, size.episodes, steps=size.steps, progress=count)
    summary = document(source, table, 0, {"backend": "cpu", "steps": size.steps})
    write_evaluation(out / "evaluation", table, summary)
    return table


def _play(bundle: Bundle, source: PolicySource, size: ShowSize) -> Session:
    player = Player(make_env(source.setup, 1, "cpu"), bundle)
    steps = size.steps or player.env.episode_length
    with counting(sys.stdout, "playing", "episodes") as count:
        return play_episodes(player, size.episodes, steps, progress=count)


def _film(
    out: Path, bundle: Bundle, source: PolicySource, size: ShowSize
) -> tuple[Session, Path]:
    player = Player(make_env(nominal(source.setup), 1, "cpu"), bundle)
    steps = round(size.film_s / player.env.dt)
    film = play_episodes(player, 1, steps, schedule=schedule_of(FILM, steps))
    path = out / "walk.mp4"
    with counting(sys.stdout, "drawing", "frames") as count:
        how = Film(path, size.fps, size.width, count)
        write_video(how, player.env, film.first)
    return film, path
