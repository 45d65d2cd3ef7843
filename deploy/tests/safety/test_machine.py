"""Every mode × every combination of inputs, and what holds in any sequence."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fingers_robot.safety import Mode, Operator, PolicyFault, Reaction, step
from fingers_robot.safety.latch import severest
from fingers_robot.safety.limits import make_limits
from fingers_robot.safety.machine import CONFIRM_TRIES, TRANSITIONS, Event

DT = 0.002


def _poison(inputs):
    pos = inputs.reading.pos_rad.copy()
    pos[3] = np.nan
    return replace(inputs, reading=replace(inputs.reading, pos_rad=pos))


def _proposal(**changes):
    def change(inputs):
        if inputs.proposal is None:
            return inputs
        return replace(inputs, proposal=replace(inputs.proposal, **changes))

    return change


BOOLEANS = {
    "no reading": lambda i: replace(i, reading=None),
    "late imu": lambda i: replace(i, imu=replace(i.imu, t_s=i.imu.t_s - 1)),
    "NaN angle": lambda i: i if i.reading is None else _poison(i),
    "no health": lambda i: replace(i, health=None),
    "driver error": lambda i: replace(i, driver_error="gone"),
    "link closed": lambda i: replace(i, link_open=False),
    "silent policy": lambda i: replace(i, proposal=None),
    "NaN target": _proposal(target_rad=np.full(20, np.nan)),
    "short target": _proposal(target_rad=np.zeros(7)),
    "old command": _proposal(command_age_s=9.0),
    "overrun": lambda i: replace(i, skipped_ticks=9),
    "no preflight": lambda i: replace(i, preflight_ok=False),
}
FAULTY = set(BOOLEANS) - {"no preflight", "silent policy"}
TOLD_BY_PROPOSAL = {"NaN target", "short target", "old command"}


def _states(make_rig):
    """A state in each mode, with inputs that would be healthy there."""
    rig = make_rig()
    rig.run(0.1)
    yield Mode.DISABLED, rig
    rig = make_rig()
    rig.run(0.1)
    rig.tick(Operator.ARM)
    rig.run(0.5)
    yield Mode.ARMING, rig
    yield Mode.ACTIVE, make_rig().activate()
    rig = make_rig().activate()
    rig.tick(Operator.STOP)
    rig.run(0.1)
    yield Mode.STOPPING, rig
    rig = make_rig().activate()
    rig.tick(Operator.STOP)
    rig.run(3, until=Mode.SAFE)
    rig.run(0.2)
    yield Mode.SAFE, rig


def test_every_mode_times_every_input(make_rig):
    seen = set()
    for mode, rig in _states(make_rig):
        # The step at which the policy's answer has arrived.
        while rig.proposed is None:
            rig.tick()
        assert rig.state.mode == mode
        for bits in itertools.product((False, True), repeat=len(BOOLEANS)):
            present = {n for n, bit in zip(BOOLEANS, bits, strict=True) if bit}
            for operator in Operator:
                if operator != Operator.NONE and len(present) > 1:
                    continue
                inputs = rig.healthy(operator)
                for name in present:
                    if name != "late imu" or inputs.imu is not None:
                        inputs = BOOLEANS[name](inputs)
                after, out = step(rig.state, inputs, rig.t, rig.limits)
                _check_step(rig, after, out, present, operator)
                seen.add((mode, after.mode))
    reachable = {(m, after) for (m, _), after in TRANSITIONS.items()}
    # Arming and settling end by time alone, which single steps from here do not reach.
    by_time = {(Mode.ARMING, Mode.ACTIVE)}
    assert {(a, b) for a, b in seen if a != b} == reachable - by_time


def _check_step(rig, after, out, present, operator):
    before = rig.state.mode
    energized = after.mode in (Mode.ARMING, Mode.ACTIVE, Mode.STOPPING)
    assert (out.target_rad is not None) == energized
    if energized:
        low, high = rig.limits.allowed_rad.T
        assert np.isfinite(out.target_rad).all()
        assert (out.target_rad >= low - 1e-9).all()
        assert (out.target_rad <= high + 1e-9).all()
        step_rad = np.abs(out.target_rad - rig.state.target_rad).max()
        assert step_rad <= rig.limits.step_rad + 1e-9
    assert out.policy_runs == (after.mode == Mode.ACTIVE)
    wrong = present & FAULTY
    if "silent policy" in present:
        wrong -= TOLD_BY_PROPOSAL
    if before in (Mode.ARMING, Mode.ACTIVE) and wrong:
        assert after.mode in (Mode.STOPPING, Mode.SAFE), present
    if before == Mode.DISABLED and after.mode != Mode.DISABLED:
        assert operator == Operator.ARM and not wrong
        assert "no preflight" not in present
    if before == Mode.SAFE and after.mode != Mode.SAFE:
        assert operator == Operator.CLEAR and after.mode == Mode.DISABLED
    assert severest(after.faults) >= severest(rig.state.faults) or (
        operator == Operator.CLEAR
    )


@pytest.mark.parametrize("pair", list(itertools.product(Mode, Event)), ids=str)
def test_the_transition_table_never_arms_by_itself(pair):
    mode, event = pair
    after = TRANSITIONS.get((mode, event), mode)
    if after == Mode.ARMING and mode != Mode.ARMING:
        assert (mode, event) == (Mode.DISABLED, Event.ARM)
    if (
        mode in (Mode.ARMING, Mode.ACTIVE, Mode.STOPPING)
        and event == Event.TRIP_DISABLE
    ):
        assert after == Mode.SAFE
    if mode == Mode.SAFE:
        assert after == (Mode.DISABLED if event == Event.CLEAR else Mode.SAFE)


FAULTS = [None, *BOOLEANS]


SEQUENCES = given(
    script=st.lists(
        st.tuples(
            st.sampled_from(FAULTS),
            st.sampled_from(list(Operator)),
            st.integers(1, 60),
        ),
        max_size=12,
    ),
    start_active=st.booleans(),
)


@settings(max_examples=80, deadline=None)
@SEQUENCES
def test_property_what_holds_in_any_sequence(make_rig, script, start_active):
    _play(make_rig, script, start_active)


@pytest.mark.slow
@pytest.mark.timeout(3600)
@settings(max_examples=5000, deadline=None)
@SEQUENCES
def test_property_what_holds_in_many_sequences(make_rig, script, start_active):
    _play(make_rig, script, start_active)


def _play(make_rig, script, start_active):
    rig = make_rig(settle_s=0.1)
    if start_active:
        rig.activate()
    for name, operator, steps in script:
        rig.fault = None if name is None else lambda i, t, n=name: BOOLEANS[n](i)
        for k in range(steps):
            before = rig.state
            rig.tick(operator if k == 0 else Operator.NONE)
            _check_sequence(before, rig)


def _check_sequence(before, rig):
    after, out, asked = rig.state, rig.out, rig.inputs.operator
    if after.mode == Mode.ACTIVE:
        assert rig.log[-1][0] - after.lease.renewed_s <= rig.limits.lease_s + 1e-9
        assert after.faults == ()
    if before.mode == Mode.SAFE and after.mode != Mode.SAFE:
        assert asked == Operator.CLEAR
    if before.mode == Mode.DISABLED and after.mode != Mode.DISABLED:
        assert asked == Operator.ARM
    if asked == Operator.NONE:
        assert severest(after.faults) >= severest(before.faults)
    if after.mode in (Mode.SAFE, Mode.DISABLED):
        assert out.target_rad is None and out.enable is not True
    else:
        assert np.isfinite(out.target_rad).all()
        if before.mode == after.mode:
            jump = np.abs(out.target_rad - before.target_rad).max()
            assert jump <= rig.limits.step_rad + 1e-9


def test_two_faults_at_once_and_one_while_settling(rig):
    rig.tick(Operator.STOP)
    rig.run(0.2)
    assert severest(rig.state.faults) == Reaction.SETTLE
    rig.fault = lambda i, t: BOOLEANS["overrun"](i)
    rig.tick()
    assert severest(rig.state.faults) == Reaction.SETTLE
    assert {f.id for f in rig.state.faults} == {"OP", "L3"}
    rig.fault = lambda i, t: BOOLEANS["driver error"](BOOLEANS["overrun"](i))
    rig.tick()
    assert rig.state.mode == Mode.SAFE


@pytest.mark.parametrize("hertz", [1, 7, 50])
def test_a_flapping_fault_latches_once_and_logs_little(rig, hertz):
    flap = BOOLEANS["overrun"]
    rig.fault = lambda i, t: flap(i) if (t * hertz) % 1 < 0.5 else i
    rig.events.clear()
    rig.run(3.0)
    assert rig.state.mode == Mode.STOPPING
    assert len(rig.events) <= 2


def test_nothing_is_sent_after_a_disable_and_it_is_asked_for_again(rig):
    rig.fault = lambda i, t: replace(
        BOOLEANS["driver error"](i), health=replace(i.health, disabled=False)
    )
    rig.run(2.0)
    start = next(k for k, (_, mode, _) in enumerate(rig.log) if mode == Mode.SAFE)
    outs = [out for _, _, out in rig.log[start:]]
    assert all(out.target_rad is None for out in outs)
    asked = [out for out in outs if out.enable is False]
    assert len(asked) > CONFIRM_TRIES and any(out.alarm for out in outs)
    assert not any(out.alarm for out in outs[: round(0.7 / DT)])


def test_clear_needs_a_healthy_hand_and_leads_to_disabled_only(rig):
    rig.fault = lambda i, t: BOOLEANS["driver error"](i)
    rig.run(0.5)
    rig.tick(Operator.CLEAR)
    assert rig.state.mode == Mode.SAFE
    assert any("clear refused" in line for line in rig.events)
    rig.fault = None
    rig.run(0.1)
    assert rig.state.mode == Mode.SAFE
    rig.tick(Operator.ARM)
    assert rig.state.mode == Mode.SAFE
    rig.tick(Operator.CLEAR)
    assert rig.state.mode == Mode.DISABLED and rig.state.faults == ()
    rig.run(1.0)
    assert rig.state.mode == Mode.DISABLED
    rig.activate()
    assert rig.state.mode == Mode.ACTIVE


def test_the_first_target_is_the_measured_pose(make_rig):
    rig = make_rig()
    rig.run(0.1)
    low, high = rig.limits.allowed_rad.T
    rig.pos = np.where(rig.pos > (low + high) / 2, low, high)
    pose = rig.pos.copy()
    out = rig.tick(Operator.ARM)
    np.testing.assert_array_equal(out.target_rad, pose)
    for _ in range(200):
        before = rig.out.target_rad
        rig.tick()
        assert np.abs(rig.out.target_rad - before).max() <= 0.02


@pytest.mark.parametrize("task", ["crawl", "recovery"])
def test_a_recovery_begins_where_the_hand_lies(bundle, limits, make_rig, task):
    made = make_limits(replace(bundle.manifest, task=task), limits.factory_rad)
    rig = make_rig(begins_at_pose=made.begins_at_pose)
    pose = rig.pos.copy()  # 0.1 rad from the rest pose
    rig.run(0.1)
    rig.tick(Operator.ARM)
    rig.run(60, until=Mode.ACTIVE)
    begins = pose if task == "recovery" else limits.rest_rad
    assert np.abs(pose - limits.rest_rad).max() > 0.09
    np.testing.assert_allclose(rig.out.target_rad, begins, atol=0.01)


def test_a_recovery_that_leans_on_a_stop_begins_within_the_limits(make_rig):
    rig = make_rig(begins_at_pose=True, joint_margin_rad=0.15)
    high = rig.limits.allowed_rad[2, 1]
    rig.pos[2] = high + 0.12
    rig.run(0.1)
    first = rig.tick(Operator.ARM).target_rad
    assert first[2] > high + 0.11  # no step when it is energized
    rig.run(60, until=Mode.ACTIVE)
    assert rig.out.target_rad[2] == high
    rig.run(0.5)
    assert rig.state.mode == Mode.ACTIVE and rig.state.faults == ()


def test_hold_goes_to_the_measured_pose_without_a_jump(rig):
    pose = rig.pos.copy()
    rig.fault = lambda i, t: BOOLEANS["overrun"](i)
    before = rig.out.target_rad
    for _ in range(100):
        out = rig.tick()
        assert np.abs(out.target_rad - before).max() <= 0.0061
        before = out.target_rad
    np.testing.assert_allclose(before, pose, atol=0.01)


def test_an_old_answer_does_not_renew_the_lease(rig):
    first = rig.state.lease
    while rig.proposed is None:
        rig.tick()
    replay = rig.proposed
    rig.fault = lambda i, t: _proposal(response=replay.response)(i)
    t0 = rig.t
    rig.run(1.0, until=Mode.STOPPING)
    assert rig.t - t0 <= 0.1
    assert "S11" in {f.id for f in rig.state.faults}
    assert first.challenge != rig.state.lease.challenge


def _fastest(rig, answers_each_step):
    """Largest change of a target per control step, of a policy that pushes on."""
    alpha, sent = rig.limits.step_rad, [rig.out.target_rad]
    kept = None
    for k in range(150):
        if rig.proposed is not None:
            kept = rig.proposed
        if answers_each_step and kept is not None:
            goal = np.clip(rig.state.target_rad + alpha, *rig.limits.allowed_rad.T)
            rig.proposed = answers_each_step(kept, goal, k)
        rig.tick()
        if rig.state.mode != Mode.ACTIVE:
            break
        if k % 10 == 0:
            sent.append(rig.out.target_rad)
    return float(np.abs(np.diff(sent, axis=0)).max()), rig


def test_a_policy_that_answers_all_the_time_moves_no_faster(rig):
    """The same challenge answered ten times over passes once."""
    fastest, rig = _fastest(rig, lambda kept, goal, k: replace(kept, target_rad=goal))
    assert rig.state.mode == Mode.ACTIVE
    assert 0.9 * rig.limits.step_rad < fastest <= rig.limits.step_rad + 1e-9


def test_a_policy_that_claims_later_steps_moves_no_faster(rig):
    fastest, rig = _fastest(
        rig, lambda kept, goal, k: replace(kept, target_rad=goal, tick=10**6 + k)
    )
    assert fastest <= rig.limits.step_rad + 1e-9


def test_targets_of_an_answer_that_renews_nothing_do_not_pass(rig):
    rig.fault = lambda i, t: _proposal(response=1)(i)
    before = rig.out.target_rad
    while rig.tick() is not None and rig.state.mode == Mode.ACTIVE:
        np.testing.assert_array_equal(rig.out.target_rad, before)
    assert {f.id for f in rig.state.faults} == {"S11"}


def test_a_command_without_an_age_is_a_lost_command(rig):
    rig.fault = lambda i, t: _proposal(command_age_s=float("nan"))(i)
    rig.run(0.1)
    assert {f.id for f in rig.state.faults} == {"S10"}


def test_a_fault_reported_by_the_policy_never_moves_the_target(rig):
    rig.fault = lambda i, t: _proposal(fault=PolicyFault.OUTPUT)(i)
    while rig.state.mode == Mode.ACTIVE:
        before = rig.out.target_rad
        rig.tick()
    np.testing.assert_array_equal(rig.out.target_rad, before)


def test_the_step_is_pure(rig):
    inputs = rig.healthy()
    pairs = [step(rig.state, inputs, rig.t, rig.limits) for _ in range(2)]
    assert repr(pairs[0]) == repr(pairs[1])
