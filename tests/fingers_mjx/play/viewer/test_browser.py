"""The page in a real browser: it draws, its knobs reach the simulation, no errors."""

import dataclasses
import io
import threading
import time
from contextlib import contextmanager

import numpy as np
import pytest
from PIL import Image
from support.cli_setup import default_hand
from support.free_port import free_port

from benchmarks.speed.browser import browser_path, opened
from envs.hand.stance import stance_of
from fingers_mjx.play.viewer.live import Live
from fingers_mjx.play.viewer.watch import watch
from sysid.logs.log import make_log

pytestmark = pytest.mark.skipif(
    browser_path() is None, reason="no Chromium or Chrome is installed"
)


@contextmanager
def page_of(watched):
    """The page, running in a thread, in a browser."""
    port, over = free_port(), threading.Event()
    page = threading.Thread(
        target=watch, args=(watched, port, lambda: not over.is_set())
    )
    page.start()
    try:
        with opened(f"http://127.0.0.1:{port}") as tab:
            tab.wait_for("running,")
            yield tab
    finally:
        over.set()
        page.join(60)


@pytest.fixture
def wished(monkeypatch):
    """What the simulation was asked for, step by step."""
    asked, step = [], Live.step

    def spy(self, wishes):
        asked.append(wishes)
        return step(self, wishes)

    monkeypatch.setattr(Live, "step", spy)
    return asked


def until(condition, seconds=60.0):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "it does not happen"
        time.sleep(0.1)


def pixels(shot):
    return np.asarray(Image.open(io.BytesIO(shot)))[..., :3].astype(int)


@pytest.fixture
def held(monkeypatch):
    """Lets no simulation pass its first second before it is set.

    A picture of it is the same on a slow machine then.
    """
    over, step = threading.Event(), Live.step

    def wait(self, wishes):
        return None if self.time_s >= 1.0 and not over.is_set() else step(self, wishes)

    monkeypatch.setattr(Live, "step", wait)
    return over


def middle_of(tab):
    return pixels(tab.picture())[250:500, 450:950]


def settled(tab):
    """A picture in which nothing moves any more."""
    seen = pixels(tab.picture())
    for _ in range(60):
        time.sleep(0.5)
        before, seen = seen, pixels(tab.picture())
        if np.array_equal(before, seen):
            return seen
    raise AssertionError("the page goes on moving")


def force_pixels(middle):
    red, green, blue = np.moveaxis(middle, 2, 0)
    return ((red - green > 90) & (green < 60) & (blue > green)).sum()


def test_a_person_sees_a_hand_that_moves_and_can_stop_it(watched, held):
    with page_of(watched) as tab:
        for text in ("forward [m/s]", "contact forces", "thumb", "mm/s"):
            tab.wait_for(text)
        tab.wait_for("running, 1.0 s")
        until(lambda: force_pixels(middle_of(tab)) > 150)
        middle = middle_of(tab)
        held.set()
        until(lambda: np.any(middle_of(tab) != middle))
        tab.click("pause")
        tab.wait_for("paused")
        settled(tab)
        assert tab.errors == []
    colourful = middle.max(axis=2) - middle.min(axis=2) > 80
    assert colourful.sum() > 300, "no finger is to be seen in the middle"
    assert force_pixels(middle) > 150, "no contact force is to be seen"


def test_knobs_reach_the_simulation(watched, wished):
    with page_of(watched) as tab:
        before = wished[-1]
        assert "deadband" not in before.effects
        tab.slide("forward [m/s]", "ArrowRight", 4)
        until(lambda: wished[-1].command[0] > before.command[0])
        tab.slide("turn [rad/s]", "ArrowLeft", 4)
        until(lambda: wished[-1].command[2] < before.command[2])
        tab.click("left")
        until(lambda: any(w.push == "left" for w in wished))
        tab.click("Effects of the drive")
        tab.click("deadband")
        until(lambda: "deadband" in wished[-1].effects)
        tab.wait_for("running,")
        assert tab.errors == []
    assert sum(w.push is not None for w in wished) == 1


def test_a_measured_log_stands_beside_the_hand(watched, held):
    hand = default_hand()
    stance, t_s = stance_of(hand), 0.02 * np.arange(500)
    columns = {
        f"{kind}.{name}": np.full(len(t_s), value)
        for name, value in zip(
            hand.nominal.joint_names, stance.joint_pos_rad, strict=True
        )
        for kind in ("cmd", "pos")
    }
    log = make_log(hand.nominal.joint_names, t_s, columns, source="walk.csv")
    shots = []
    for log_or_none in (log, None):
        with page_of(dataclasses.replace(watched, log=log_or_none)) as tab:
            if log_or_none is not None:
                tab.wait_for("measured: walk.csv")
            tab.wait_for("running, 1.0 s")
            tab.click("pause")
            tab.wait_for("paused")
            shots.append(settled(tab)[100:600, 300:1000])
    blue = [(s[..., 2] - s[..., 0] > 60).sum() for s in shots]
    assert blue[0] > 1.5 * blue[1] + 300, "no second hand is to be seen"
