"""A camera's samples through the socket: what comes in, and what does not."""

import json
import math
import socket

import numpy as np
import pytest

from fingers_deploy.errors import InputError
from fingers_robot.behaviour.tracker_port import TrackerPort, read_sample
from fingers_robot.behaviour.tracking import Frame, ObjectTracker

SAMPLE = {
    "t_s": 3.0,
    "object_pos_w": [0.4, 0.1, 0.02],
    "root_pos_w": [0.2, 0.0, 0.1],
    "heading_rad": 0.3,
    "target_pos_w": [0.7, 0.2, 0.02],
}
V_QUAT, DOWN = (0.8, 0.0, -0.6, 0.0), np.array([0.96, 0.0, -0.28])


class Camera:
    def __init__(self, path):
        self.end = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.path = str(path)

    def __call__(self, **changes):
        self.raw(json.dumps({**SAMPLE, **changes}).encode())

    def raw(self, data):
        self.end.sendto(data, self.path)


@pytest.fixture
def port(tmp_path):
    opened = TrackerPort(tmp_path / "tracker", V_QUAT)
    yield opened
    opened.close()


@pytest.fixture
def camera(port, tmp_path):
    made = Camera(tmp_path / "tracker")
    yield made
    made.end.close()


def test_samples_become_the_inputs_of_the_tracker(port, camera):
    tracker = ObjectTracker(SAMPLE["target_pos_w"], V_QUAT)
    for k in range(10):
        pos = [0.4 + 0.01 * k, 0.1, 0.02]
        camera(t_s=3.0 + k / 60, object_pos_w=pos)
        tracker.update(Frame(3.0 + k / 60, pos, SAMPLE["root_pos_w"], 0.3))
        assert port.poll(7.0 + k) == 0.0
    np.testing.assert_array_equal(port.inputs(DOWN), tracker.inputs(DOWN))
    assert np.abs(port.inputs(DOWN)[3:6]).max() > 0.1
    assert port.poll(16.5) == pytest.approx(0.5)


def test_nothing_has_come_yet(port):
    assert port.poll(1.0) == math.inf
    assert not port.inputs(DOWN).any()


def test_a_target_may_move_without_a_jump_of_the_velocity(port, camera):
    camera()
    camera(t_s=3.1, object_pos_w=[0.45, 0.1, 0.02])
    port.poll(0.0)
    before = port.inputs(DOWN)
    camera(t_s=3.1001, object_pos_w=[0.45, 0.1, 0.02], target_pos_w=[0.1, 0.1, 0.02])
    port.poll(0.0)
    after = port.inputs(DOWN)
    np.testing.assert_allclose(before[:6], after[:6], atol=1e-3)
    assert np.abs(before[6:] - after[6:]).max() > 0.1


def test_a_camera_that_repeats_itself_grows_old_until_it_is_lost(port, camera):
    camera()
    port.poll(10.0)
    for k in range(1, 40):
        camera()
        assert port.poll(10.0 + 0.02 * k) == pytest.approx(0.02 * k)
    camera(t_s=1.0)  # restarted: its clock begins anew
    assert port.poll(12.0) == 0.0


BAD = {
    "no JSON": b"{",
    "not UTF-8": b"\xff\xfe",
    "deep": b"[" * 4000,
    "a list": b"[1, 2]",
    "empty": b"",
    "no target": json.dumps({k: SAMPLE[k] for k in list(SAMPLE)[:4]}).encode(),
    "one more": json.dumps({**SAMPLE, "x": 1}).encode(),
    "NaN": json.dumps({**SAMPLE, "heading_rad": float("nan")}).encode(),
    "infinite": json.dumps({**SAMPLE, "object_pos_w": [0, 0, float("inf")]}).encode(),
    "far": json.dumps({**SAMPLE, "object_pos_w": [0, 0, 1e9]}).encode(),
    "text": json.dumps({**SAMPLE, "t_s": "3.0"}).encode(),
    "true": json.dumps({**SAMPLE, "t_s": True}).encode(),
    "short": json.dumps({**SAMPLE, "root_pos_w": [1.0, 2.0]}).encode(),
}


@pytest.mark.parametrize("name", BAD)
def test_what_is_no_sample_counts_for_nothing_and_is_said(port, camera, name):
    camera()
    port.poll(1.0)
    before = port.inputs(DOWN)
    camera.raw(BAD[name])
    assert port.poll(1.5) == pytest.approx(0.5)
    np.testing.assert_array_equal(port.inputs(DOWN), before)
    assert port.problem.startswith("tracker") and "\n" not in port.problem
    with pytest.raises(InputError):
        read_sample(BAD[name])


def test_a_place_that_holds_something_else_is_refused_and_kept(tmp_path):
    path = tmp_path / "notes"
    path.write_text("mine")
    with pytest.raises(InputError, match="notes"):
        TrackerPort(path, V_QUAT)
    assert path.read_text() == "mine"
    with pytest.raises(InputError, match="a place for a socket"):
        TrackerPort(tmp_path / ("x" * 200), V_QUAT)


def test_a_socket_of_a_run_that_was_killed_is_taken_over(tmp_path):
    first = TrackerPort(tmp_path / "tracker", V_QUAT)
    second = TrackerPort(tmp_path / "tracker", V_QUAT)
    second.close()
    first._socket.close()
    assert list(tmp_path.iterdir()) == []
