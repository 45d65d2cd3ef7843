"""From a policy to a page that runs in real time until it is stopped."""

import dataclasses
import os
import sys
import time
import webbrowser
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from envs.errors import InputError
from fingers_mjx.play.player import Player
from fingers_mjx.play.viewer.ghost import Ghost, heading, motion_of
from fingers_mjx.play.viewer.live import Live
from fingers_mjx.play.viewer.page import Page, serving
from fingers_mjx.play.viewer.panel import Knobs
from fingers_mjx.play.viewer.switches import switches
from fingers_mjx.play.viewer.view import body_poses
from fingers_mjx.runs.setup import Setup, make_env
from sysid.logs.log import MeasuredLog

DRAWN_HZ, PLOTTED_HZ = 25.0, 5.0
BEHIND_S = 0.25
"""Of real time; what is later than that is not caught up with."""
NEVER_S = 1e6
"""Between commands of the task itself: the person gives them."""
SLOW = 0.95


@dataclass(frozen=True)
class Watched:
    """What is watched.

    Attributes:
        name: of the policy.
        setup: of the worlds.
        make: makes the policy's player in the worlds of a setup.
        seed: of the episodes.
        command: at the start: v_x, v_y [m/s] and yaw rate [rad/s]; half of the fastest
            forward motion of training if None.
        log: a measured log beside the simulation.
    """

    name: str
    setup: Setup
    make: Callable[[Setup], Player]
    seed: int = 0
    command: tuple[float, float, float] | None = None
    log: MeasuredLog | None = None


def watch(watched: Watched, port: int, goes_on: Callable[[], bool] = lambda: True):
    """Serves the page until the process is interrupted.

    Args:
        watched: what is watched.
        port: of this machine, where the page is.
        goes_on: asked before every control step; the page ends when it says no.

    Raises:
        InputError: the port is taken, the log is not that of a whole hand, or settings
            with which there is no environment.
    """
    setup = _without_own_commands(watched.setup)
    motion = (
        None
        if watched.log is None
        else motion_of(watched.log, setup.hand.nominal.joint_names)
    )
    knobs = knobs_for(watched)
    env = make_env(setup, 1, "cpu")
    model = env.mj_model
    with serving(port) as server:
        page = Page(server, model, knobs, watched.name)
        page.scene.hand.move(body_poses(_at_rest(model, env.stance.qpos)))
        page.panel.say("compiling the simulation, some seconds")
        _announce(server.get_port())
        live = Live(
            lambda hand: watched.make(dataclasses.replace(setup, hand=hand)),
            setup.hand,
            watched.seed,
        )
        ghost = None if motion is None else Ghost(model, motion)
        Loop(live, page, ghost).run(goes_on)


class Loop:
    """Steps the simulation in real time and draws it, more rarely.

    Args:
        live: the simulation.
        page: where it is drawn.
        ghost: a measured hand; None without.
    """

    def __init__(self, live: Live, page: Page, ghost: Ghost | None):
        self._live, self._page, self._ghost = live, page, ghost
        self._draw, self._plot = _Every(1 / DRAWN_HZ), _Every(1 / PLOTTED_HZ)
        self._speed, self._stepped_s = 1.0, time.perf_counter()

    def run(self, goes_on: Callable[[], bool]) -> None:
        """Runs for as long as `goes_on` says."""
        due_s = time.perf_counter()
        while goes_on():
            self.step()
            due_s = max(due_s + self._live.dt_s, time.perf_counter() - BEHIND_S)
            time.sleep(max(0.0, due_s - time.perf_counter()))

    def step(self) -> None:
        """One control step, and what is to be drawn of it."""
        live, page = self._live, self._page
        wishes = page.panel.wishes()
        if live.compiles_for(wishes):
            page.panel.say("compiling the drive with its effects, some seconds")
        view = live.step(wishes)
        now_s = time.perf_counter()
        if view is not None:
            self._note_speed(now_s)
            page.plots.add(live.time_s, view)
            if self._draw.due(now_s):
                page.scene.face(heading(live.start_pose[3:]))
                page.draw(view)
                self._draw_ghost()
            if self._plot.due(now_s):
                page.plot(view)
        self._stepped_s = now_s
        page.panel.say(self._status(wishes.paused))

    def _note_speed(self, now_s: float) -> None:
        passed_s = max(now_s - self._stepped_s, 1e-6)
        self._speed += 0.05 * (min(self._live.dt_s / passed_s, 2.0) - self._speed)

    def _status(self, paused: bool) -> str:
        if paused:
            return "**paused**"
        if self._live.fell:
            return "**the hand fell**; a new episode begins"
        slow = f", {self._speed:.1f} × real time" if self._speed < SLOW else ""
        return f"running, {self._live.time_s:.1f} s{slow}"

    def _draw_ghost(self) -> None:
        if self._ghost is None:
            return
        live, start = self._live, self._live.start_pose
        angle = heading(start[3:]) + np.pi / 2
        aside = self._page.panel.aside_m * np.array([np.cos(angle), np.sin(angle), 0.0])
        poses = self._ghost.at(live.time_s, start, live.pose)
        self._page.scene.show_ghost(poses, aside)


class _Every:
    """Whether something that happens so often is due."""

    def __init__(self, period_s: float):
        self._period_s, self._next_s = period_s, 0.0

    def due(self, now_s: float) -> bool:
        if now_s < self._next_s:
            return False
        self._next_s = now_s + self._period_s
        return True


def knobs_for(watched: Watched) -> Knobs:
    """Returns what there is to turn.

    Raises:
        InputError: a command outside the training range, or of a task without.
    """
    ranges, command = _ranges(watched.setup), watched.command
    if ranges is None and command is not None:
        raise InputError("--command", "", list(command), "none: this task has none")
    if command is None:
        command = (0.0 if ranges is None else 0.5 * ranges[0][1], 0.0, 0.0)
    for index, (low, high) in enumerate(ranges or ()):
        if not low <= command[index] <= high:
            valid = f"{low:g} to {high:g}"
            raise InputError("--command", f"[{index}]", command[index], valid)
    return Knobs(
        ranges,
        command,
        switches(watched.setup.hand),
        None if watched.log is None else Path(watched.log.source).name,
    )


def _ranges(setup: Setup) -> tuple[tuple[float, float], ...] | None:
    command = getattr(setup.env, "command", None)
    if command is None:
        return None
    return (command.vel_x_mps, command.vel_y_mps, command.yaw_rate_rps)


def _without_own_commands(setup: Setup) -> Setup:
    if _ranges(setup) is None:
        return setup
    command = dataclasses.replace(setup.env.command, resample_s=NEVER_S)
    return dataclasses.replace(
        setup, env=dataclasses.replace(setup.env, command=command)
    )


def _at_rest(model: mujoco.MjModel, qpos) -> mujoco.MjData:
    data = mujoco.MjData(model)
    data.qpos[: len(qpos)] = qpos
    mujoco.mj_kinematics(model, data)
    return data


def _announce(port: int) -> None:
    """Says where the page is, and opens it where there is a screen."""
    url = f"http://127.0.0.1:{port}"
    print(f"viewer: {url} (Ctrl-C ends it)", flush=True)
    screen = sys.platform in ("darwin", "win32") or os.environ.get("DISPLAY")
    if sys.stdout.isatty() and screen:
        webbrowser.open(url)
