import re
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from fingers_deploy.errors import InputError
from fingers_robot.drivers.sim import SimDriver, SimulatorProcess
from fingers_robot.runtime.guard import make_safe
from fingers_robot.simulator.command_path import CommandPath
from fingers_robot.simulator.hand import SimulatedHand, load_model

FREE = '<joint name="root" type="free"/>'
HINGE = '<joint name="root" type="hinge" axis="0 0 1"/>'


@pytest.fixture(scope="module")
def interface(marching):
    return marching.manifest.interface


def test_it_is_exact_and_repeatable(hand_model, interface):
    target, ends = np.asarray(interface.initial_target_rad), []
    for _ in range(2):
        hand = SimulatedHand(hand_model, interface.joint_names, seed=4)
        assert not hand.state()["enabled"]
        hand.set_enabled(True)
        hand.target_rad = target
        hand.advance(0.5)
        assert hand.state()["t_s"] == pytest.approx(0.5)
        assert hand.state()["enabled"]
        ends.append(hand.state().tobytes())
    assert ends[0] == ends[1]


def test_in_real_time_it_holds_the_last_target_until_a_guard_comes(
    hand_model, interface
):
    with SimulatorProcess(hand_model, interface, lifetime_s=30.0) as process:
        driver = SimDriver(process.path, interface)
        driver.enable()
        driver.write(np.asarray(interface.initial_target_rad))
        driver._socket.close()  # as when its process dies
        second = SimDriver(process.path, interface)
        assert make_safe(second)
        second.close()


_STARTER = """
import os, sys
from fingers_deploy import load_bundle
from fingers_robot.drivers.sim import SimulatorProcess
interface = load_bundle(sys.argv[2]).manifest.interface
print(SimulatorProcess(sys.argv[1], interface).process.pid, flush=True)
os._exit(1)  # as when it is killed
"""


def test_a_simulator_ends_with_whoever_started_it(hand_model, marching_dir):
    program = [sys.executable, "-c", _STARTER, str(hand_model), str(marching_dir)]
    done = subprocess.run(program, stdout=subprocess.PIPE, check=False)
    running = Path(f"/proc/{int(done.stdout)}/stat")

    def ended():
        try:
            return running.read_text().rpartition(")")[2].split()[0] == "Z"
        except OSError:
            return True

    deadline = time.monotonic() + 20
    while not ended() and time.monotonic() < deadline:
        time.sleep(0.02)
    assert ended()


def test_a_simulator_that_goes_away_is_an_error(hand_model, interface):
    process = SimulatorProcess(hand_model, interface)
    driver = SimDriver(process.path, interface)
    process.close()
    with pytest.raises(OSError):
        for _ in range(100):
            driver.read()
            driver.write(np.zeros(20))
    driver.close()


def test_de_energized_joints_hold_by_friction_and_do_not_follow(hand_model, interface):
    hand = SimulatedHand(hand_model, interface.joint_names)
    before = hand.data.qpos[7:].copy()
    hand.target_rad = before + 0.5
    hand.advance(0.5)
    assert np.abs(hand.data.qpos[7:] - before).max() < 0.05
    hand.set_enabled(True)
    hand.advance(1.5)
    assert np.abs(hand.data.qpos[7:] - before).max() > 0.3


def test_command_path_delays_filters_and_limits():
    zero, one = np.zeros(20), np.ones(20)
    path = CommandPath(zero, 0.005, 0.02, None, np.inf)
    assert [path.step(one)[0] for _ in range(6)] == [0, 0, 0, 0, 1, 1]
    path = CommandPath(zero, 0.001, 0.0, 3.0, np.inf)
    steps = round(1 / (2 * np.pi * 3.0) / 0.001)
    values = [path.step(one)[0] for _ in range(steps)]
    assert values[-1] == pytest.approx(1 - np.exp(-1), abs=0.005)
    path = CommandPath(zero, 0.005, 0.0, None, 2.0)
    np.testing.assert_allclose(path.step(one), 0.01)
    each = np.array([2.8, 2.5, 2.8, 2.8] * 5)
    path = CommandPath(zero, 0.005, 0.0, None, each)
    np.testing.assert_allclose(path.step(one), 0.005 * each)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda t: t.replace("<mujoco", "<mojoco", 1), "MJCF"),
        (lambda t: t.replace("finger3_joint2", "other_joint"), "finger3_joint2"),
        (lambda t: t.replace('timestep="0.005"', 'timestep="-1"'), "timestep"),
        (
            lambda t: t.replace("</worldbody>", '<include file="/etc/passwd"/>'),
            "another",
        ),
        (lambda t: re.sub("<key .*/>", "", t).replace(FREE, HINGE), "free root"),
        (lambda t: "", "MJCF"),
        (lambda t: "\0", "MJCF"),
    ],
)
def test_bad_models_are_refused_in_one_sentence(
    hand_model, interface, tmp_path, change, words
):
    text = hand_model.read_text()
    changed = change(text)
    assert changed != text
    path = tmp_path / "hand.xml"
    path.write_text(changed)
    with pytest.raises(InputError, match=words) as caught:
        SimulatedHand(path, interface.joint_names)
    assert "\n" not in str(caught.value)


def test_the_process_says_why_it_refuses(interface, tmp_path):
    with pytest.raises(InputError, match="nowhere"):
        SimulatorProcess(tmp_path / "nowhere.xml", interface)


@pytest.mark.parametrize(
    "attribute",
    ['file="/etc/passwd"', 'file = "x.stl"', 'fileright="x.png"', "file\n='../x.stl'"],
)
def test_a_model_that_names_another_file_is_refused_before_it_is_opened(
    tmp_path, attribute
):
    path = tmp_path / "hand.xml"
    path.write_text(f"<mujoco><asset><mesh name='a' {attribute}/></asset></mujoco>")
    with pytest.raises(InputError, match="a model in one file"):
        load_model(path)


@pytest.mark.parametrize(
    "inner",
    [
        "<replicate count='100000'><body/></replicate>",
        "<replicate count='40'><replicate count='40'/></replicate>",
        "<body>" * 200 + "</body>" * 200,
        "<geom/>" * 20_001,
        "<hfield nrow='1000000' ncol='2'/>",
    ],
)
def test_a_model_that_is_endless_is_refused(tmp_path, inner):
    path = tmp_path / "hand.xml"
    path.write_text(f"<mujoco><worldbody>{inner}</worldbody></mujoco>")
    with pytest.raises(InputError, match="at most"):
        load_model(path)


def test_a_document_type_is_refused(tmp_path):
    path = tmp_path / "hand.xml"
    path.write_text('<!DOCTYPE a [<!ENTITY b "c">]><mujoco>&b;</mujoco>')
    with pytest.raises(InputError, match="document type"):
        load_model(path)
