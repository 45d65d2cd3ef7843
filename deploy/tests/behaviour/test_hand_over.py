"""Switching policies is continuous: nothing jumps, nothing is forgotten."""

import dataclasses

import numpy as np
import pytest

from fingers_deploy import PolicyController
from fingers_deploy.rotations import conjugate, gravity
from fingers_robot.behaviour.command import FixedCommand
from fingers_robot.behaviour.exchange import Query
from fingers_robot.behaviour.hand_over import (
    Moment,
    action_for,
    asked_for,
    build_history,
)
from fingers_robot.behaviour.heading import HeadingConfig
from fingers_robot.behaviour.policies import Policies
from fingers_robot.behaviour.sources import Sources
from fingers_robot.safety import PolicyFault

SEED = 17


@pytest.fixture(scope="module")
def other(bundle_factory, weights_factory, interface):
    """Another policy: other reference, scale, α and clip."""
    changed = dataclasses.replace(
        interface,
        reference_angles_rad=tuple(0.9 * r for r in interface.reference_angles_rad),
        action=dataclasses.replace(interface.action, scale_rad=0.028, clip=2.0),
    )
    return bundle_factory(changed, weights_factory(action_clip=2.0))


class Runner:
    """Drives `Policies` as the supervisor would, with a hand that follows."""

    def __init__(self, bundles, sticks=(1.0, 0.5, -0.5), tasks=None, hold=None):
        controllers = tuple(PolicyController(b, "numpy") for b in bundles)
        self.policies = Policies(controllers, Sources(FixedCommand(sticks), hold))
        self.interface = bundles[0].manifest.interface
        self.rng = np.random.default_rng(SEED)
        self.target = np.asarray(self.interface.initial_target_rad, np.float64)
        self.pos, self.k = self.target.copy(), 0
        self.quat, self.gyro = conjugate(self.interface.v_quat_b), np.zeros(3)

    def step(self, policy=0, runs=True):
        query = Query(
            tick=self.k,
            t_s=0.02 * self.k,
            challenge=5,
            joint_pos=self.pos,
            quat_w=self.quat,
            gyro_b=self.gyro + 0.1 * self.rng.standard_normal(3),
            target_rad=self.target,
            runs=runs,
            policy=policy,
        )
        answer = self.policies.answer(query)
        self.k += 1
        self.last = self.target
        self.target = answer.proposal.target_rad.copy()
        self.pos = self.pos + 0.3 * (self.target - self.pos)
        return answer

    def observation(self):
        return self.policies._controllers[self.policies.active].observation


def test_actions_translate_between_scales(interface, other):
    rng, theirs = np.random.default_rng(1), other.manifest.interface
    action = rng.uniform(-3, 3, 20).astype(np.float32)
    np.testing.assert_allclose(
        action_for(asked_for(action, interface), interface), action, atol=2e-6
    )
    small = rng.uniform(-0.4, 0.4, 20)
    asked = asked_for(small, interface)
    np.testing.assert_allclose(asked_for(action_for(asked, theirs), theirs), asked)
    # What the other policy cannot ask for is clipped to the most that it can.
    most = action_for(np.full(20, 0.06), theirs)
    np.testing.assert_allclose(most, 2.0, rtol=1e-6)


def test_from_a_policy_to_itself_nothing_changes(bundle):
    switched, straight = Runner([bundle, bundle]), Runner([bundle, bundle])
    for k in range(60):
        first = switched.step(policy=k // 20 % 2)
        second = straight.step(policy=0)
        assert (first.policy, second.policy) == (k // 20 % 2, 0)
        np.testing.assert_allclose(
            switched.observation(), straight.observation(), atol=2e-6
        )
        np.testing.assert_allclose(switched.target, straight.target, atol=2e-5)


def test_a_fresh_start_in_its_place_would_not_pass(bundle):
    """Negative control: without the history the observation is another one."""
    switched, straight = Runner([bundle, bundle]), Runner([bundle, bundle])
    for _ in range(20):
        switched.step(), straight.step()
    switched.policies._moments.clear()
    switched.step(policy=1), straight.step(policy=0)
    assert np.abs(switched.observation() - straight.observation()).max() > 0.01


def test_to_another_policy_targets_go_on_without_a_jump(bundle, other):
    runner = Runner([bundle, other])
    for k in range(40):
        runner.step(policy=int(k >= 20))
        alpha = 0.06 if k < 20 else 0.028
        assert np.abs(runner.target - runner.last).max() <= alpha + 1e-6


def test_the_other_policy_sees_what_it_would_have_seen(bundle, other):
    """The history in its own terms, against a brute-force construction."""
    runner, seen = Runner([bundle, other]), []
    theirs = other.manifest.interface
    for _ in range(20):
        pos, quat = runner.pos, runner.quat
        runner.step()
        asked = asked_for(
            runner.policies._controllers[0].action, bundle.manifest.interface
        )
        seen.append((pos, gravity(quat), asked))
    runner.step(policy=1)
    observation = runner.observation()
    reference = np.asarray(theirs.reference_angles_rad)
    pos_block = observation[: 8 * 20].reshape(8, 20)
    wanted = np.array([pos for pos, _, _ in seen[-7:]]) - reference
    np.testing.assert_allclose(pos_block[:7], wanted, atol=1e-5)
    action_block = observation[8 * 26 : 8 * 46].reshape(8, 20)
    wanted = np.array([action_for(asked, theirs) for _, _, asked in seen[-8:]])
    np.testing.assert_allclose(action_block, wanted, atol=1e-5)


def test_no_history_at_all_is_an_episode_start(bundle):
    controller = PolicyController(bundle, "numpy")
    interface = bundle.manifest.interface
    history, action = build_history((), interface, controller.assembler)
    assert history is None and not action.any()
    moment = Moment(np.zeros(20), np.zeros(3), np.zeros(3), {}, np.zeros(20))
    history, _ = build_history((moment,), interface, controller.assembler)
    assert all(np.ptp(part, axis=0).max() == 0 for part in history)


def test_while_it_does_not_run_a_policy_proposes_the_targets_on_the_wire(bundle):
    runner = Runner([bundle])
    for _ in range(5):
        answer = runner.step(runs=False)
        np.testing.assert_array_equal(answer.proposal.target_rad, runner.last)
    runner.step(runs=True)
    fresh = Runner([bundle])
    fresh.k, fresh.rng = runner.k - 1, np.random.default_rng(0)
    assert runner.policies._controllers[0].observation is not None


def test_a_bad_measurement_is_reported(bundle):
    runner = Runner([bundle])
    runner.step()
    runner.pos = np.full(20, np.nan)
    assert runner.step().proposal.fault == PolicyFault.OBSERVATION


def test_a_network_that_breaks_is_reported(bundle):
    runner = Runner([bundle])
    runner.step()
    runner.policies._controllers[0]._policy = lambda obs: np.full(20, np.nan)
    assert runner.step().proposal.fault == PolicyFault.OUTPUT


def test_an_unknown_policy_is_ignored(bundle):
    runner = Runner([bundle])
    for number in (0, 7, -1, 0):
        assert runner.step(policy=number).policy == 0


def _recovery(bundle_factory, interface):
    return dataclasses.replace(
        bundle_factory(interface),
        manifest=dataclasses.replace(
            bundle_factory(interface).manifest, task="recovery"
        ),
    )


def test_recovery_settles_into_the_first_policy_once_upright(
    bundle, bundle_factory, interface
):
    runner = Runner([bundle, _recovery(bundle_factory, interface)])
    fallen, upright = np.array([1.0, 0, 0, 0]), runner.quat
    runner.quat = fallen
    for _ in range(50):
        assert runner.step(policy=1).policy == 1
    runner.quat = upright
    phases, speeds = [], []
    for _ in range(140):
        answer = runner.step(policy=1)
        phases.append((answer.policy, runner.policies._ramp is not None))
        speeds.append(np.abs(runner.target - runner.last).max())
    assert max(speeds) <= 0.06 + 1e-6
    begun = phases.index((1, True))
    done = next(k for k, (policy, _) in enumerate(phases) if policy == 0)
    assert begun == 25  # 0.5 s
    assert 1.5 <= 0.02 * (done - begun) <= 4.0
    assert all(policy == 0 for policy, _ in phases[done:])
    # It had reached the first policy's pose when that one began.
    assert not runner.policies._controllers[0].faults


def test_recovery_alone_holds_the_stance_that_it_settled_into(
    bundle_factory, interface
):
    runner = Runner([_recovery(bundle_factory, interface)])
    upright, runner.quat = runner.quat, np.array([1.0, 0, 0, 0])
    for k in range(160):
        runner.step()
        assert runner.policies.settling == (k >= 35)
        runner.quat = upright if k >= 9 else runner.quat
    stance = np.asarray(interface.initial_target_rad)
    np.testing.assert_allclose(runner.target, stance, atol=1e-12)


@pytest.mark.parametrize("walks_first", [True, False])
def test_a_hand_that_stands_is_not_given_to_a_recovery(
    bundle, bundle_factory, interface, walks_first, monkeypatch
):
    """It settles at once, wherever the selection comes from."""
    runner = Runner([bundle, _recovery(bundle_factory, interface)])
    if walks_first:
        for _ in range(20):
            runner.step(policy=0)
    recovery = runner.policies._controllers[1]
    monkeypatch.setattr(recovery, "step", None)  # whoever called it would fail
    answers = [runner.step(policy=1) for _ in range(220)]
    assert runner.policies.active == 0 and not runner.policies.settling
    assert [a.policy for a in answers[:75]] == [1] * 75


def test_heading_hold_replaces_the_yaw_rate(bundle):
    hold = HeadingConfig(1.0, 0.05, -0.45, 0.45)
    runner = Runner([bundle], sticks=(0.0, 0.0, 0.0), hold=hold)
    runner.step()
    turned = np.array([np.cos(0.1), 0, 0, np.sin(0.1)])
    from fingers_deploy.rotations import multiply

    runner.quat = multiply(turned, runner.quat)
    answer = runner.step()
    assert answer.command[2] == pytest.approx(-0.2 + 0.05, abs=1e-5)
    assert np.isnan(answer.command[3:]).all()
