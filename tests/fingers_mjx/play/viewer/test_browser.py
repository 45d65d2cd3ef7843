"""The page in a real browser: it draws, its knobs reach the simulation, no errors."""

import io
import threading

import numpy as np
import pytest
from PIL import Image
from support.free_port import free_port

from benchmarks.speed.browser import browser_path, opened
from fingers_mjx.play.viewer.watch import watch

pytestmark = pytest.mark.skipif(
    browser_path() is None, reason="no Chromium or Chrome is installed"
)


@pytest.fixture
def address(watched):
    """The page, running in a thread until the test is over."""
    port, over = free_port(), threading.Event()
    page = threading.Thread(
        target=watch, args=(watched, port, lambda: not over.is_set())
    )
    page.start()
    yield f"http://127.0.0.1:{port}"
    over.set()
    page.join(60)


def test_a_person_sees_a_hand_that_moves_and_can_stop_it(address):
    with opened(address) as tab:
        tab.wait_for("running,")
        for text in ("forward [m/s]", "contact forces", "thumb", "mm/s"):
            tab.wait_for(text)
        tab.click("Effects of the drive")
        tab.wait_for("deadband")
        tab.click("pause")
        tab.wait_for("paused")
        shot = tab.picture()
        assert tab.errors == []
    picture = np.asarray(Image.open(io.BytesIO(shot)))
    middle = picture[250:500, 450:950, :3].astype(int)
    colourful = middle.max(axis=2) - middle.min(axis=2) > 80
    assert colourful.sum() > 300, "no finger is to be seen in the middle"
    red, green, blue = np.moveaxis(middle, 2, 0)
    force = (red - green > 90) & (green < 60) & (blue > green)
    assert force.sum() > 150, "no contact force is to be seen"
