"""The loop in virtual time: L7, preflight, and that the parts fit together."""

import ast
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from faults.lab import Lab
from hand_files import WALKING, marching_bundle
from hypothesis import given, settings
from hypothesis import strategies as st

import fingers_robot
from fingers_deploy.bundle import load_bundle
from fingers_robot.record.row import ROW
from fingers_robot.runtime.core import Core
from fingers_robot.runtime.ticker import Tick
from fingers_robot.safety import Mode, Operator

SEED = 7
PACKAGE = Path(fingers_robot.__file__).parent


class Sink:
    def __init__(self):
        self.rows, self.events = [], []

    def row(self, t_s, row):
        self.rows.append(np.array(row))

    def event(self, t_s, line):
        self.events.append(line)


@pytest.fixture(scope="module")
def walk(hand_model, marching):
    """Four seconds of a run, with what was recorded of it."""
    lab = Lab(hand_model, (marching,), loop_hz=250)
    lab.core._sink = Sink()
    lab.activate().run(4.0)
    return lab


def test_the_hand_walks_under_the_supervisor(walk):
    assert walk.mode == Mode.ACTIVE and walk.core.state.faults == ()
    moved = np.ptp([target for _, target in walk.driver.written[-500:]], axis=0)
    assert (moved > 0.02).sum() >= 5
    assert walk.driver.hand.data.qpos[2] > 0.11


def test_every_control_step_is_recorded(walk):
    rows = np.array(walk.core._sink.rows).view(ROW)
    assert np.diff(rows["tick"]).tolist() == [1] * (len(rows) - 1)
    np.testing.assert_allclose(np.diff(rows["t"]), 0.02, atol=1e-6)
    active = rows[rows["mode"] == Mode.ACTIVE]
    assert np.isfinite(active["pos"]).all() and np.isfinite(active["cmd"]).all()
    assert np.isfinite(active["command"][:, :3]).all()
    np.testing.assert_allclose(np.linalg.norm(active["gravity"], axis=1), 1, atol=1e-5)
    assert (active["enabled"] == 1).all()
    assert "arming -> active" in walk.core._sink.events


def test_targets_are_those_of_the_policy_alone(walk, marching):
    """The supervisor changes nothing while all is well: replayed through the policy."""
    from fingers_deploy import PolicyController

    rows = np.array(walk.core._sink.rows).view(ROW)
    first = int(np.argmax(rows["mode"] == Mode.ACTIVE))
    controller = PolicyController(marching, "numpy")
    controller.reset(rows["cmd"][first])
    for before, after in zip(rows[first:-1], rows[first + 1 :], strict=True):
        target = controller.step(
            before["pos"], before["gravity"], before["gyro"], after["command"][:3]
        )
        np.testing.assert_allclose(target, after["cmd"], atol=2e-4)


def test_a_policy_process_cannot_choose_milder_limits(hand_model, marching):
    lab = Lab(hand_model, (marching, marching_bundle("recovery")), loop_hz=250)
    lab.activate()
    recovering = lab.core._limits[1]
    assert recovering.tilt_s == 10.0 and lab.core.limits.tilt_s == 0.1
    poll = lab.link.poll
    lab.link.poll = lambda: (a := poll()) and replace(a, policy=1)
    lab.run(0.1)
    assert lab.core.limits.tilt_s == 0.1
    lab.core.selected = 1  # by the operator
    lab.run(0.1)
    assert lab.core.limits is recovering


def test_a_policy_that_is_late_now_and_then_is_no_fault(hand_model):
    """Two answers at once carry the motion of two steps: the targets catch up."""
    lab = Lab(
        hand_model, (load_bundle(WALKING),), sticks=(1.0, 0.0, 0.0), loop_hz=250
    ).activate()
    rng, step = np.random.default_rng(SEED), lab.core.limits.step_rad
    lab.forget()
    late = 0
    for _ in range(300):
        lab.link.delay_s = 0.0305 if rng.random() < 0.2 else 0.001
        late += lab.link.delay_s > 0.02
        lab.run(0.02)
    targets = np.array([target for _, target in lab.driver.written])
    assert late > 30 and lab.mode == Mode.ACTIVE, lab.events
    assert np.abs(np.diff(targets, axis=0)).max() <= step + 1e-6


def test_jumps_of_the_wall_clock_change_nothing(hand_model, marching, monkeypatch):
    def targets(wall):
        monkeypatch.setattr(time, "time", wall)
        lab = Lab(hand_model, (marching,), loop_hz=250)
        lab.core._sink = Sink()
        lab.activate().run(1.0)
        assert lab.mode == Mode.ACTIVE
        return np.array([target for _, target in lab.driver.written]), lab.core._sink

    jumps = iter(np.tile([0.0, 3600.0, -3600.0, 1e9, 0.5], 100_000))
    still, _ = targets(lambda: 0.0)
    jumped, sink = targets(lambda: next(jumps))
    np.testing.assert_array_equal(still, jumped)
    walls = np.array([float(row["unix_s"]) for row in sink.rows])
    assert np.abs(np.diff(walls)).max() > 3000


def test_the_wall_clock_is_only_written_down():
    """Nothing but the recording reads it."""
    users = set()
    for file in PACKAGE.rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text("utf-8"))):
            if isinstance(node, ast.Attribute) and node.attr in ("time", "time_ns"):
                owner = node.value
                if isinstance(owner, ast.Name) and owner.id == "time":
                    users.add(file.name)
    assert users == {"core.py", "recorder.py"}


def test_no_socket_listens_on_a_network():
    for file in PACKAGE.rglob("*.py"):
        text = file.read_text("utf-8")
        assert "AF_INET" not in text and "http.server" not in text
        if ".listen(" in text:
            assert "AF_UNIX" in text


def test_arming_is_refused_with_a_reason_until_everything_is_there(
    hand_model, marching
):
    lab = Lab(hand_model, (marching,), loop_hz=250)
    lab.tick(Operator.ARM)
    assert lab.mode == Mode.DISABLED and "arm refused" in lab.events[-1][1]
    lab.link.silent = True
    lab.run(0.5)
    lab.tick(Operator.ARM)
    assert "lease" in lab.events[-1][1] and lab.mode == Mode.DISABLED


def test_a_control_step_counts_from_its_own_deadline(hand_model, marching):
    """Blocked in the middle of the work: the next tick is on time, the step is not."""
    lab = Lab(hand_model, (marching,), loop_hz=500)
    lab.run(0.1)
    lab.core._sink = Sink()
    while lab.number % 10 != 9:
        lab.tick()
    lab.tick(skip=4)  # 8 ms after the deadline of the control step
    assert lab.core._sink.rows[-1].view(ROW)["late_s"].item() == pytest.approx(0.008)
    assert lab.core.stats.summary()["late_over_5ms"] == 1


@settings(max_examples=30, deadline=None)
@given(st.lists(st.integers(0, 12), max_size=40))
def test_property_control_steps_are_counted_however_ticks_are_missed(skips):
    core = Core.__new__(Core)
    core._per_control, core._last_control = 5, 0
    number, seen, skipped = 0, [], 0
    for skip in skips:
        number += 1 + skip
        control, missed = core._control(Tick(number, 0.0, 0.0, skip))
        if control >= 0:
            seen.append(control)
            skipped += missed
    assert seen == sorted(set(seen))
    if seen:
        assert len(seen) + skipped == seen[-1]
