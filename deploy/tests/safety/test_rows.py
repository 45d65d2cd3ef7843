"""Each row of the table: trips in time, not early, grows as the table says."""

from dataclasses import replace

import numpy as np
import pytest

from fingers_deploy.rotations import multiply
from fingers_robot.safety import ROWS, Mode, Operator, PolicyFault, Reaction
from fingers_robot.safety.latch import severest
from fingers_robot.safety.limits import make_limits
from fingers_robot.safety.table import BY_ID

DT = 0.002


def _set(array, index, value):
    changed = array.copy()
    changed[index] = value
    return changed


def _late(inputs, t0, t):
    return replace(
        inputs, reading=replace(inputs.reading, t_s=min(t0, inputs.reading.t_s))
    )


def _finger_frozen(finger):
    kept = []

    def fault(inputs, t0, t):
        r, joints = inputs.reading, slice(4 * finger, 4 * finger + 4)
        kept.append(r.pos_rad[joints]) if not kept else None
        return replace(
            inputs, reading=replace(r, pos_rad=_set(r.pos_rad, joints, kept[0]))
        )

    return fault


class _Frozen:
    def __init__(self, part):
        self.part, self.kept = part, None

    def __call__(self, inputs, t0, t):
        sample = getattr(inputs, self.part)
        self.kept = self.kept or sample
        return replace(inputs, **{self.part: replace(self.kept, t_s=sample.t_s)})


def _reading(**changes):
    def fault(inputs, t0, t):
        r = inputs.reading
        return replace(
            inputs, reading=replace(r, **{k: f(r) for k, f in changes.items()})
        )

    return fault


def _imu(**changes):
    def fault(inputs, t0, t):
        i = inputs.imu
        return replace(inputs, imu=replace(i, **{k: f(i) for k, f in changes.items()}))

    return fault


def _health(**changes):
    def fault(inputs, t0, t):
        h = inputs.health
        return replace(
            inputs, health=replace(h, **{k: f(h) for k, f in changes.items()})
        )

    return fault


def _proposal(**changes):
    def fault(inputs, t0, t):
        p = inputs.proposal
        if p is None:
            return inputs
        return replace(
            inputs, proposal=replace(p, **{k: f(p) for k, f in changes.items()})
        )

    return fault


def _always(**changes):
    return lambda inputs, t0, t: replace(inputs, **changes)


def _old_health(inputs, t0, t):
    return replace(inputs, health=replace(inputs.health, t_s=min(t0, t)))


def _rolled(angle):
    half = np.deg2rad(angle) / 2
    turn = np.array([np.cos(half), np.sin(half), 0.0, 0.0])
    return _imu(quat_w=lambda i: multiply(turn, i.quat_w))


def _age(inputs, t0, t):
    if inputs.proposal is None:
        return inputs
    return replace(inputs, proposal=replace(inputs.proposal, command_age_s=t - t0))


NAN = float("nan")
SCENARIOS = {
    "S1 late joints": _late,
    "S1 late IMU": lambda i, t0, t: replace(i, imu=replace(i.imu, t_s=min(t0, t))),
    "S2 frozen joints": _Frozen("reading"),
    "S2 frozen IMU": _Frozen("imu"),
    "S2b probe lost": _old_health,
    "S3 NaN angle": _reading(pos_rad=lambda r: _set(r.pos_rad, 3, NAN)),
    "S3 infinite angle": _reading(pos_rad=lambda r: _set(r.pos_rad, 3, np.inf)),
    "S3 NaN effort": _reading(effort_a=lambda r: _set(r.effort_a, 3, NAN)),
    "S3 NaN gyro": _imu(gyro_b=lambda i: _set(i.gyro_b, 0, NAN)),
    "S3 quaternion": _imu(quat_w=lambda i: 0.5 * i.quat_w),
    "S3 NaN quaternion": _imu(quat_w=lambda i: _set(i.quat_w, 2, NAN)),
    "S3 reported by the policy": _proposal(fault=lambda p: PolicyFault.OBSERVATION),
    "S4 NaN target": _proposal(target_rad=lambda p: _set(p.target_rad, 1, NAN)),
    "S4 infinite target": _proposal(target_rad=lambda p: np.inf * p.target_rad),
    "S4 step": _proposal(target_rad=lambda p: p.target_rad + 0.5),
    "S4 reported by the policy": _proposal(fault=lambda p: PolicyFault.OUTPUT),
    "S5 over-current": _reading(effort_a=lambda r: _set(r.effort_a, 7, 1.2)),
    "S5 negative": _reading(effort_a=lambda r: _set(r.effort_a, 7, -1.2)),
    "S6 effort limit": _health(effort_limit_a=lambda h: 1.5 * h.effort_limit_a),
    "S6 hot": _health(temperature_c=lambda h: _set(h.temperature_c, 9, 80.0)),
    "S6 temperature": _health(temperature_c=lambda h: _set(h.temperature_c, 9, NAN)),
    "S6 low supply": _health(bus_v=lambda h: 11.0),
    "S6 error bit": _health(error_code=lambda h: _set(h.error_code, 4, 1 << 8)),
    "S7 roll": _rolled(40),
    "S8 beyond": _reading(pos_rad=lambda r: _set(r.pos_rad, 2, 2.5)),
    "S10 command": _age,
    "S11 silence": _always(proposal=None),
    "S11 wrong answer": _proposal(response=lambda p: p.response ^ 1),
    "S12 closed": _always(link_open=False, proposal=None),
    "S15 exception": _always(driver_error="ConnectionError: gone"),
    "S18 partial": _proposal(target_rad=lambda p: p.target_rad[:19]),
    "S18 empty": _proposal(target_rad=lambda p: p.target_rad[:0]),
    "L3 skipped": _always(skipped_ticks=4),
}  # fmt: skip
OTHER_TESTS = {"S5 stall", "S8b", "S17", "S20", "L7", "OP", "OFF"}


def test_every_row_has_a_test():
    tested = {name.split()[0] for name in [*SCENARIOS, *OTHER_TESTS]}
    assert tested == {row.id for row in ROWS}


def _inject(rig, scenario):
    """Runs with the fault from now on; returns the time of the first reaction."""
    t0 = rig.t
    rig.fault = lambda inputs, t: scenario(inputs, t0, t)
    while rig.state.mode == Mode.ACTIVE and rig.t < t0 + 3:
        rig.tick()
    return rig.log[-1][0] - t0


@pytest.mark.parametrize("name", SCENARIOS)
def test_the_fault_is_found_in_time_and_reacted_to(rig, name):
    row = BY_ID[name.split()[0]]
    # The policy answers once per control step, which is when its faults begin.
    reaction_s = _inject(rig, SCENARIOS[name])
    assert row.id in {fault.id for fault in rig.state.faults}
    assert reaction_s <= row.within_s + DT
    assert severest(rig.state.faults) == row.reaction
    wanted = Mode.SAFE if row.reaction == Reaction.DISABLE else Mode.STOPPING
    assert rig.state.mode == wanted


@pytest.mark.parametrize("name", SCENARIOS)
def test_the_reaction_grows_as_the_table_says(rig, name):
    row = BY_ID[name.split()[0]]
    _inject(rig, SCENARIOS[name])
    found = rig.t
    rig.run(2.5)
    modes = {mode: t for t, mode, _ in reversed(rig.log)}
    if row.worse is None and row.reaction == Reaction.HOLD:
        assert rig.state.mode == Mode.STOPPING
    elif row.worse == Reaction.DISABLE:
        assert modes[Mode.SAFE] - found == pytest.approx(row.after_s, abs=0.03)
    elif row.reaction < Reaction.DISABLE:
        settled = rig.limits.settle_s + row.after_s
        assert modes[Mode.SAFE] - found == pytest.approx(settled, abs=0.1)
        assert np.abs(rig.pos - rig.limits.rest_rad).max() < 0.02


ONCE = {
    "S1 late joints": 0.020,
    "S1 late IMU": 0.020,
    "S2 frozen joints": 0.080,
    "S2 frozen IMU": 0.040,
    "S2b probe lost": 0.300,
    "S5 over-current": 0.010,
    "S7 roll": 0.080,
    "S11 silence": 0.030,
    "S10 command": 0.900,
}


@pytest.mark.parametrize("name", ONCE)
def test_what_passes_in_time_does_not_trip(rig, name):
    t0 = rig.t
    rig.fault = lambda inputs, t: (
        SCENARIOS[name](inputs, t0, t) if t - t0 < ONCE[name] else inputs
    )
    rig.run(2.0)
    assert rig.state.mode == Mode.ACTIVE and rig.state.faults == ()


def test_a_stalled_joint_trips_after_a_second(rig):
    fault = _reading(effort_a=lambda r: _set(r.effort_a, 7, 0.95))
    assert 1.0 <= _inject(rig, fault) <= 1.0 + BY_ID["S5"].within_s
    assert {f.id for f in rig.state.faults} == {"S5"}


def test_tilt_below_the_limit_does_not_trip(rig):
    rig.fault = lambda inputs, t: _rolled(34)(inputs, 0, t)
    rig.run(1.0)
    assert rig.state.mode == Mode.ACTIVE


def test_a_joint_that_does_not_follow_trips(make_rig):
    rig = make_rig(tracking_rad=0.03).activate()
    stuck = rig.pos[0]

    def blocked(r):
        return _set(r.pos_rad, 0, stuck + 1e-6 * rig.rng.normal())

    reaction_s = _inject(rig, _reading(pos_rad=blocked))
    assert reaction_s >= rig.limits.tracking_s
    assert "S8b" in {f.id for f in rig.state.faults}


def test_a_recovery_may_lie_for_long_before_it_is_armed_and_then_has_ten_seconds(
    make_rig,
):
    rig = make_rig(begins_at_pose=True, tilt_s=10.0)
    rig.fault = lambda inputs, t: _rolled(90)(inputs, 0, t)
    rig.run(15.0)
    rig.activate()
    begun = next(t for t, mode, _ in rig.log if mode == Mode.ACTIVE)
    rig.run(20.0, until=Mode.STOPPING)
    assert rig.t - begun == pytest.approx(10.0, abs=0.01)
    assert {f.id for f in rig.state.faults} == {"S7"}


@pytest.mark.parametrize(("task", "stops"), [("crawl", True), ("recovery", False)])
def test_a_hand_that_gets_up_may_lean_on_its_stops(
    bundle, limits, make_rig, task, stops
):
    made = make_limits(replace(bundle.manifest, task=task), limits.factory_rad)
    rig = make_rig(joint_margin_rad=made.joint_margin_rad).activate()
    leans = limits.factory_rad[2, 1] + 0.12
    rig.fault = lambda inputs, t: _reading(pos_rad=lambda r: _set(r.pos_rad, 2, leans))(
        inputs, 0, t
    )
    rig.run(0.1)
    assert ("S8" in {f.id for f in rig.state.faults}) == stops


@pytest.mark.parametrize("angle_rad", [2.5, -6.283, NAN])
def test_an_angle_that_cannot_be_is_not_held(rig, angle_rad):
    """The joint stays where it was, instead of going to its limit at full speed."""
    where = rig.state.pose_rad.copy()
    rig.fault = lambda inputs, t: _reading(
        pos_rad=lambda r: _set(r.pos_rad, 2, angle_rad)
    )(inputs, 0, t)
    rig.run(0.03)
    assert rig.state.mode == Mode.STOPPING
    np.testing.assert_allclose(rig.out.target_rad, where, atol=0.03)
    rig.run(1.0)
    if rig.out.target_rad is not None:
        np.testing.assert_allclose(rig.out.target_rad, where, atol=0.03)


@pytest.mark.parametrize("finger", range(5))
def test_one_finger_that_freezes_while_it_moves_is_found(rig, finger):
    """In time after its targets have moved by 0.1 rad, and it stays found."""
    reaction_s = _inject(rig, _finger_frozen(finger))
    assert {f.id for f in rig.state.faults} == {"S2"}
    assert f"finger {finger + 1} frozen" in rig.state.faults[0].detail
    assert reaction_s <= 0.5
    rig.run(0.5)
    assert rig.state.mode == Mode.SAFE


def test_one_finger_that_rests_is_no_fault(rig):
    held, frozen = rig.state.target_rad.copy(), _finger_frozen(2)

    def fault(inputs, t):
        inputs, p = frozen(inputs, 0, t), inputs.proposal
        if p is None:
            return inputs
        target = _set(p.target_rad, slice(8, 12), held[8:12])
        return replace(inputs, proposal=replace(p, target_rad=target))

    rig.fault = fault
    rig.run(1.0)
    assert rig.state.mode == Mode.ACTIVE and rig.state.faults == ()


def test_frozen_joints_while_nothing_moves_are_no_fault(rig):
    held = rig.state.target_rad.copy()
    frozen = SCENARIOS["S2 frozen joints"].__class__("reading")

    def fault(inputs, t):
        inputs = frozen(inputs, 0, t)
        if inputs.proposal is None:
            return inputs
        return replace(inputs, proposal=replace(inputs.proposal, target_rad=held))

    rig.fault = fault
    rig.run(1.0)
    assert rig.state.mode == Mode.ACTIVE


def test_the_clock_going_back_disables(rig):
    rig.t -= 5.0
    rig.tick()
    assert rig.state.mode == Mode.SAFE
    assert "L7" in {f.id for f in rig.state.faults}


def test_a_pause_of_the_supervisor_itself_holds(rig):
    rig.count += 60
    rig.t = rig.count * DT
    rig.tick()
    assert rig.state.mode == Mode.STOPPING
    assert "L3" in {f.id for f in rig.state.faults}


def test_operator_stop_settles_and_disables(rig):
    rig.tick(Operator.STOP)
    assert rig.state.mode == Mode.STOPPING
    rig.run(2.0, until=Mode.SAFE)
    assert np.abs(rig.pos - rig.limits.rest_rad).max() < 0.02
    rig.run(0.1)
    assert rig.state.confirmed and not rig.enabled


def _arm_with(rig, scenario):
    rig.run(0.1)
    rig.tick(Operator.ARM)
    rig.fault = lambda inputs, t: scenario(inputs, 0, t)
    rig.run(20, until=Mode.SAFE)
    return {f.id for f in rig.state.faults}


def test_power_that_is_not_confirmed_ends_arming(make_rig):
    assert _arm_with(make_rig(), _health(enabled=lambda h: False)) == {"S20"}


def test_fast_and_slow_angles_that_differ_end_arming(make_rig):
    wrong = _health(pos_rad=lambda h: _set(h.pos_rad, 5, 2.0))
    assert _arm_with(make_rig(), wrong) == {"S20"}


def test_wiggle_passes_on_a_sound_hand(make_rig):
    rig = make_rig(wiggle=(0, 7, 19)).activate()
    assert rig.state.mode == Mode.ACTIVE


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        ("swapped", "instead of 0.05"),
        ("reversed", "instead of 0.05"),
        ("stuck", "instead of 0.05"),
        ("coupled", "with joint 7"),
    ],
)
def test_wiggle_finds_a_wrong_hand(make_rig, kind, words):
    rig = make_rig(wiggle=(7,))
    start = rig.pos.copy()

    def wrong(r):
        moved = r.pos_rad - start
        pos = r.pos_rad.copy()
        if kind == "swapped":
            pos[[7, 8]] = start[[7, 8]] + moved[[8, 7]]
        elif kind == "reversed":
            pos[7] = start[7] - moved[7]
        elif kind == "stuck":
            pos[7] = start[7] + rig.rng.normal() * 1e-6
        else:
            pos[8] += moved[7]
        return pos

    assert _arm_with(rig, _reading(pos_rad=wrong)) == {"S17"}
    assert any(words in line for line in rig.events)


@pytest.mark.parametrize("settling", [False, True])
def test_off_de_energizes_at_once_whatever_it_does(make_rig, settling):
    rig = make_rig()
    rig.activate()
    if settling:
        rig.tick(Operator.STOP)
        rig.run(0.2)
        assert rig.state.mode == Mode.STOPPING
    rig.tick(Operator.OFF)
    assert rig.state.mode == Mode.SAFE and rig.out.enable is False
    assert rig.out.target_rad is None


def test_off_changes_nothing_that_is_off(make_rig):
    rig = make_rig()
    rig.run(0.1)
    rig.tick(Operator.OFF)
    assert rig.state.mode == Mode.DISABLED and rig.state.faults == ()
