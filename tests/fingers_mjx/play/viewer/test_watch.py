"""The page as it is served: what a browser gets, and what is refused."""

import dataclasses
import socket
import urllib.request

import pytest
from support.free_port import free_port

from envs.errors import InputError
from fingers_mjx.play.viewer import watch as module
from fingers_mjx.play.viewer.colours import OKABE_ITO
from fingers_mjx.play.viewer.page import serving
from fingers_mjx.play.viewer.panel import Knobs, Panel
from fingers_mjx.play.viewer.watch import knobs_for, watch


def test_a_port_that_is_taken_is_one_sentence():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(InputError, match=f"--port: found {port}"), serving(port):
            pass


def test_a_command_outside_the_training_range_is_refused(watched):
    far = dataclasses.replace(watched, command=(1.0, 0.0, 0.0))
    with pytest.raises(InputError, match=r"--command.*0 to 0.16"):
        knobs_for(far)


def test_sliders_have_the_ranges_of_training(watched):
    knobs = knobs_for(watched)
    assert knobs.ranges[0] == watched.setup.env.command.vel_x_mps
    assert knobs.command == (0.08, 0.0, 0.0)


def test_the_page_is_served_and_drawn_until_it_ends(watched, capsys, monkeypatch):
    """What is on the page can be read from the server, so that no browser is needed."""
    port = free_port()
    pages, seen = [], {}
    make = module.Page
    monkeypatch.setattr(module, "Page", lambda *a: pages.append(make(*a)) or pages[0])
    steps = iter(range(100_000))

    def goes_on() -> bool:
        count = next(steps)
        if count == 30:
            url = f"http://127.0.0.1:{port}"
            seen["html"] = urllib.request.urlopen(url).read()
        return count < 60

    watch(watched, port, goes_on)
    assert b"viser" in seen["html"].lower()
    assert capsys.readouterr().out == (
        f"viewer: http://127.0.0.1:{port} (Ctrl-C ends it)\n"
    )
    page = pages[0]
    times, achieved, command = page.plots._data(0)
    assert len(times) > 30
    assert command[-1] == pytest.approx(0.08)
    assert achieved.std() > 0.0
    assert page.scene._near.position[2] == 0.0
    assert "mm/s" in page._dials.content
    with socket.socket() as probe:  # the port is free again
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        probe.bind(("127.0.0.1", port))


def test_where_training_knew_one_command_there_is_nothing_to_slide():
    knobs = Knobs(((0.0, 0.0), (-0.1, 0.1), (0.2, 0.2)), (0.0, 0.0, 0.2), ())
    with serving(free_port()) as server:
        panel = Panel(server, knobs, OKABE_ITO)
        assert panel.wishes().command == (0.0, 0.0, 0.2)
