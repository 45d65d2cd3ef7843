"""Policies of every task behind the same link: inputs, dead-man, switching."""

import dataclasses
import json
import socket

import numpy as np
import pytest

from fingers_deploy import PolicyController
from fingers_deploy.manifest import Observation, Term
from fingers_deploy.rotations import conjugate, multiply
from fingers_robot.behaviour.command import FixedCommand, Frame
from fingers_robot.behaviour.exchange import Query
from fingers_robot.behaviour.heading import HeadingConfig
from fingers_robot.behaviour.keyboard.fingertip import pressing_fingertip
from fingers_robot.behaviour.keyboard.keys import ARROWS
from fingers_robot.behaviour.keyboard.runner import KeyRunner
from fingers_robot.behaviour.policies import STAND_S, Policies
from fingers_robot.behaviour.sources import Sources
from fingers_robot.behaviour.tracker_port import TrackerPort

INPUTS = {
    "keyboard": (
        Term("request", 4, "key", "1", 1.0, 8),
        Term("fingertip_pos", 3, "V", "m", 1.0, 8),
    ),
    "push": (
        Term("object_pos", 3, "V", "m", 1.0, 8),
        Term("object_vel", 3, "V", "m/s", 1.0, 8),
        Term("object_to_target", 3, "V", "m", 1.0, 8),
    ),
}
SIZES = {"keyboard": 424, "push": 440}
TURNED = (0.74, 0.0, -0.67260687, 0.0)
FRAME = {"object_pos_w": [0.4, 0.1, 0.02], "root_pos_w": [0.2, 0.0, 0.1],
         "heading_rad": 0.3, "target_pos_w": [0.7, 0.2, 0.02]}  # fmt: skip


@pytest.fixture(scope="module")
def bundles(bundle, bundle_factory, weights_factory, interface):
    made = {"crawl": bundle}
    for task, inputs in INPUTS.items():
        terms = (*interface.observation.terms[:4], *inputs)
        changed = dataclasses.replace(
            interface, observation=Observation(terms), command_ranges=()
        )
        if task == "keyboard":
            low, high = np.array(interface.joint_limits_rad).T
            stance = np.clip(np.array(interface.initial_target_rad) + 0.4, low, high)
            changed = dataclasses.replace(
                changed,
                v_quat_b=TURNED,
                initial_target_rad=tuple(stance.tolist()),
                action=dataclasses.replace(interface.action, scale_rad=0.028),
            )
        sizes = (SIZES[task], 16, 20)
        whole = bundle_factory(changed, weights_factory(sizes))
        manifest = dataclasses.replace(whole.manifest, task=task)
        made[task] = dataclasses.replace(whole, manifest=manifest)
    return made


class Operator:
    """A gamepad whose dead-man button a test holds or lets go of."""

    def __init__(self, sticks=(1.0, 0.0, 0.0)):
        self.sticks, self.held, self.age_s = sticks, True, 0.0

    def poll(self, t):
        return Frame(t - self.age_s, self.sticks, self.held)

    def close(self):
        pass


class Run:
    """Drives `Policies` as the supervisor would, with a hand that follows."""

    def __init__(self, bundles, *names, **sources):
        chosen = [bundles[name] for name in names]
        controllers = tuple(PolicyController(b, "numpy") for b in chosen)
        self.operator = sources.pop("operator", None) or Operator()
        self.policies = Policies(controllers, Sources(self.operator, **sources))
        self.interface = chosen[0].manifest.interface
        self.target = np.asarray(self.interface.initial_target_rad, np.float64)
        self.pos, self.k = self.target.copy(), 0
        self.quat, self.moved = conjugate(self.interface.v_quat_b), 0.0

    def step(self, policy=0, runs=True, key=0, turned_rad=0.0):
        query = Query(
            tick=self.k,
            t_s=50.0 + 0.02 * self.k,
            joint_pos=self.pos,
            quat_w=self.quat,
            gyro_b=np.zeros(3),
            target_rad=self.target,
            runs=runs,
            policy=policy,
            key=key,
            turned_rad=turned_rad,
        )
        answer = self.policies.answer(query)
        self.k += 1
        self.seen = self.pos
        self.moved = np.abs(answer.proposal.target_rad - self.target).max()
        self.target = answer.proposal.target_rad.copy()
        self.pos = self.pos + 0.3 * (self.target - self.pos)
        return answer

    @property
    def observation(self):
        return self.policies._controllers[self.policies.active].observation


def test_a_keyboard_policy_reads_requests_and_its_fingertip(bundles):
    run = Run(bundles, "keyboard")
    asked = []
    for k in range(150):
        answer = run.step(key=1 + ARROWS.index("down") if k == 3 else 0)
        v_quat = bundles["keyboard"].manifest.interface.v_quat_b
        np.testing.assert_allclose(
            answer.command[4:7], pressing_fingertip(run.seen, v_quat), atol=1e-6
        )
        assert answer.proposal.fault == 0 and np.isnan(answer.command[7:]).all()
        asked.append(answer.command[:4].tolist())
        assert 0 < run.moved <= 0.028 + 1e-6
    one_hot = [float(name == "down") for name in ARROWS]
    assert asked.count(one_hot) == pytest.approx(75, abs=2)  # 1.5 s, its time-out
    assert asked[5] == [0.0] * 4 and asked[-1] == [0.0] * 4


def test_without_the_dead_man_no_key_is_asked_for(bundles):
    run = Run(bundles, "keyboard", keys=KeyRunner(("up", "up")))
    run.operator.held = False
    assert not any(run.step().command[:4].any() for _ in range(60))
    run.operator.held = True
    assert any(run.step().command[:4].any() for _ in range(60))


def test_a_gamepad_or_keyboard_that_is_lost_is_reported_to_the_supervisor(bundles):
    class Gone:
        lost = True

        def poll(self):
            return ()

    run = Run(bundles, "keyboard")
    run.operator.age_s = 3.0
    assert run.step().proposal.command_age_s == pytest.approx(3.0)
    run = Run(bundles, "keyboard", keys=KeyRunner((), Gone()))
    assert run.step().proposal.command_age_s == np.inf


@pytest.fixture
def camera(tmp_path, bundles):
    port = TrackerPort(
        tmp_path / "tracker", bundles["push"].manifest.interface.v_quat_b
    )
    end = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)

    def sees(t_s, x=0.4):
        table = {**FRAME, "t_s": t_s, "object_pos_w": [x, 0.1, 0.02]}
        end.sendto(json.dumps(table).encode(), str(tmp_path / "tracker"))

    yield port, sees
    end.close()
    port.close()


def test_a_push_policy_reads_what_the_camera_sees(bundles, camera):
    port, sees = camera
    run = Run(bundles, "push", tracker=port)
    for k in range(20):
        sees(k / 60, 0.4 + 0.001 * k)
        answer = run.step()
        assert answer.proposal.command_age_s == 0.0 and run.moved > 0
    np.testing.assert_allclose(
        answer.command, port.inputs([0.96, 0.0, -0.28]), atol=1e-5
    )
    assert answer.command[:3].any() and answer.command[3:6].any()


@pytest.mark.parametrize("tracked", [False, True])
def test_a_push_policy_without_a_camera_stands_still_and_says_so(
    bundles, camera, tracked
):
    run = Run(bundles, "push", tracker=camera[0] if tracked else None)
    for _ in range(10):
        assert run.step().proposal.command_age_s == np.inf
        assert run.moved == 0.0


@pytest.mark.parametrize("why", ["dead-man", "camera"])
def test_a_push_policy_is_held_and_goes_on_where_it_was(bundles, camera, why):
    port, sees = camera
    run = Run(bundles, "push", tracker=port)

    def steps(count, seen=True):
        moved = []
        for _ in range(count):
            if seen:
                sees(0.02 * run.k)
            answer = run.step()
            moved.append(run.moved)
        return moved, answer

    moved, _ = steps(30)
    assert all(moved)
    run.operator.held = why != "dead-man"
    moved, answer = steps(40, seen=why != "camera")
    # Without samples it is noticed after 250 ms.
    assert not any(moved[15:]) and (why == "camera" or not any(moved))
    if why == "camera":
        assert answer.proposal.command_age_s == pytest.approx(0.8, abs=0.03)
    run.operator.held = True
    before = run.pos
    moved, _ = steps(1)
    assert 0 < moved[0] <= 0.06 + 1e-6
    # Its history holds the joints of the steps in which it was held.
    reference = np.asarray(run.interface.reference_angles_rad)
    block = run.observation[: 8 * 20].reshape(8, 20) + reference
    np.testing.assert_allclose(block[-1], before, atol=1e-5)
    np.testing.assert_allclose(np.ptp(block, axis=0), 0.0, atol=0.02)


def test_to_another_stance_the_hand_stands_then_goes_by_its_own(bundles):
    run = Run(bundles, "crawl", "keyboard")
    crawl, keyboard = (
        np.asarray(bundles[name].manifest.interface.initial_target_rad)
        for name in ("crawl", "keyboard")
    )
    for _ in range(50):
        run.step()
    by_own, numbers, commands = np.inf, [], []
    for _ in range(400):
        answer = run.step(policy=1)
        numbers.append(answer.policy)
        commands.append(answer.command[:3])
        by_own = min(by_own, np.abs(run.target - crawl).max())
        # From when it has stood, no faster than either policy may.
        standing = 0.02 * len(numbers) <= STAND_S + 0.03
        assert run.moved <= (0.06 if standing else 0.028) + 1e-6
        if answer.policy == 1:
            break
        last = run.target
    assert by_own < 1e-3
    # The target before its first step was its stance.
    np.testing.assert_allclose(last, keyboard, atol=1e-3)
    assert STAND_S + 3.0 <= 0.02 * len(numbers) <= STAND_S + 6.0
    assert not np.any(commands[15])  # it walks no more
    assert run.step(policy=1).policy == 1
    # Its history is that of the ramp, with its own fingertip.
    v_quat = bundles["keyboard"].manifest.interface.v_quat_b
    tips = run.observation[8 * 50 :].reshape(8, 3)
    np.testing.assert_allclose(
        tips[-1], pressing_fingertip(run.seen, v_quat), atol=1e-6
    )
    assert tips.all() and np.abs(np.diff(tips, axis=0)).max() < 0.01


def test_changing_ones_mind_on_the_way_leads_back(bundles):
    run = Run(bundles, "crawl", "keyboard")
    for _ in range(60):
        run.step(policy=1)
    numbers = []
    for _ in range(300):
        numbers.append(run.step(policy=0).policy)
        assert run.moved <= 0.06 + 1e-6
    assert set(numbers) == {0} and not run.policies.settling


def test_between_tasks_in_one_stance_nothing_waits(bundles, camera):
    port, sees = camera
    run = Run(bundles, "crawl", "push", tracker=port)
    for k in range(60):
        sees(0.02 * k)
        answer = run.step(policy=k // 20 % 2)
        assert answer.policy == k // 20 % 2
        assert run.moved <= 0.06 + 1e-6
        if k == 20:
            # While crawling the camera sent samples as well: the history knows of it.
            seen = run.observation[8 * 46 : 8 * 49].reshape(8, 3)
            assert seen.all()


@pytest.mark.parametrize("held", [True, False])
def test_heading_hold_turns_only_while_the_dead_man_is_held(bundles, held):
    hold = HeadingConfig(1.0, 0.0, -0.45, 0.45)
    run = Run(bundles, "crawl", heading_hold=hold, operator=Operator((0.0, 0.0, 0.0)))
    run.step()
    run.operator.held = held
    half = 0.1
    run.quat = multiply([np.cos(half), 0.0, 0.0, np.sin(half)], run.quat)
    rate = run.step().command[2]
    assert rate == pytest.approx(-0.2 if held else 0.0, abs=1e-5)
    # What it turned meanwhile is not turned back afterwards.
    run.operator.held = True
    assert run.step().command[2] == pytest.approx(rate, abs=1e-5)


def test_a_turn_changes_the_heading_that_is_held(bundles):
    hold = HeadingConfig(1.0, 0.0, -0.45, 0.45)
    run = Run(bundles, "crawl", heading_hold=hold, operator=Operator((0.0, 0.0, 0.0)))
    run.step()
    assert run.step(turned_rad=0.2).command[2] == pytest.approx(0.2, abs=1e-5)
    # The sum of the turns stays: it is not turned once more.
    assert run.step(turned_rad=0.2).command[2] == pytest.approx(0.2, abs=1e-5)
    assert run.step(turned_rad=0.1).command[2] == pytest.approx(0.1, abs=1e-5)


def test_a_turn_while_nobody_holds_the_button_is_forgotten(bundles):
    hold = HeadingConfig(1.0, 0.0, -0.45, 0.45)
    run = Run(bundles, "crawl", heading_hold=hold, operator=Operator((0.0, 0.0, 0.0)))
    run.operator.held = False
    run.step()
    assert run.step(turned_rad=0.2).command[2] == 0.0
    run.operator.held = True
    assert run.step(turned_rad=0.2).command[2] == pytest.approx(0.0, abs=1e-5)


def test_heading_hold_stays_within_what_the_policy_knows(bundles):
    crawl = bundles["crawl"]
    interface = dataclasses.replace(
        crawl.manifest.interface, command_ranges=((0.0, 0.0),) * 3
    )
    manifest = dataclasses.replace(crawl.manifest, interface=interface)
    still = {"recovery": dataclasses.replace(crawl, manifest=manifest)}
    hold = HeadingConfig(1.0, 0.2, -0.45, 0.45)
    run = Run(still, "recovery", heading_hold=hold)
    run.step()
    assert not run.step().command[:3].any()


def test_a_fixed_command_holds_the_dead_man(bundles):
    controllers = (PolicyController(bundles["crawl"], "numpy"),)
    policies = Policies(controllers, Sources(FixedCommand((1.0,))))
    assert policies.finish() == ()
