"""Each effect against a closed form, or as the limit of a simpler one."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from support import effects_rig as rig

from envs.actuator.catalogue import CATALOGUE
from envs.actuator.chain import JointInput, chain_step, init_states
from envs.actuator.effect import lognormal, normal
from envs.hand.drive.servo import CommandPath, ServoDrive, command_step

INF = np.inf
RAMP = np.linspace(0.0, 0.5, 200)


def test_delay_shifts_the_command():
    for delay_s, age in ((0.02, 20.0), (0.0105, 10.5)):
        _, _, x = rig.run({"transport_delay": {"delay_s": delay_s}}, RAMP)
        expected = np.interp(np.arange(200) - age, np.arange(200), RAMP)
        assert x.command == pytest.approx(expected, abs=1e-6)


def test_lowpass_has_the_time_constant_of_its_cutoff():
    cutoff_hz = 3.0
    _, _, x = rig.run({"lowpass_cutoff": {"cutoff_hz": cutoff_hz}}, rig.jump(1.0, 0.2))
    t = np.arange(200) * rig.DT
    expected = -np.expm1(-2.0 * np.pi * cutoff_hz * t)
    assert x.command == pytest.approx(expected, abs=2e-5)


def test_slew_is_constant_whatever_the_step():
    for size in (0.5, 2.0):
        _, _, x = rig.run({"slew_limit": {"speed_rad_s": 2.8}}, rig.jump(size, 0.1))
        assert np.diff(x.command)[:99] == pytest.approx(2.8e-3, abs=1e-6)


def test_quantized_commands_are_whole_steps_half_a_step_off_at_most():
    step = 0.013
    _, _, x = rig.run({"command_quantization": {"step_rad": step}}, RAMP)
    assert x.command / step == pytest.approx(np.round(x.command / step), abs=1e-4)
    assert np.max(np.abs(x.command - RAMP)) == pytest.approx(0.5 * step, rel=0.1)


def test_stiffness_divides_the_droop_under_load():
    load = -0.1
    for scale in (0.5, 2.0):
        q, _, _ = rig.run({"stiffness": {"scale": scale}}, rig.hold(0.0, 0.6), load)
        assert q[-1] == pytest.approx(load / (scale * rig.KP), rel=0.01)


def test_damping_at_the_critical_value_does_not_overshoot():
    critical = 2.0 * np.sqrt(rig.KP * rig.INERTIA) / rig.KD
    for scale, overshoots in ((1.05 * critical, False), (0.3 * critical, True)):
        q, _, _ = rig.run({"damping": {"scale": scale}}, rig.jump(0.1, 0.3))
        assert (np.max(q) > 0.1001) == overshoots


def test_deadband_parks_the_joint_at_its_edge_without_effort():
    width = 0.02
    friction = {"viscous_friction": {"damping_nms": 0.2}}
    deadband = {"deadband": {"half_width_rad": width}}
    q, _, x = rig.run({**deadband, **friction}, rig.jump(0.1, 1.0))
    assert q[-1] == pytest.approx(0.1 - width, abs=1e-3)
    assert abs(x.torque[-1]) < 1e-3


def test_torque_limit_gives_a_constant_acceleration():
    limit = 0.05
    _, v, x = rig.run(
        {"torque_limit": {"limit_nm": limit}}, rig.jump(3.0, 0.05), kd=0.0
    )
    assert np.max(np.abs(x.torque)) == pytest.approx(limit)
    assert np.diff(v)[5:40] / rig.DT == pytest.approx(limit / rig.INERTIA, rel=1e-3)


def test_coulomb_friction_holds_up_to_its_bound():
    bound = {"coulomb_friction": {"torque_nm": 0.05}}
    for load, moves in ((0.049, False), (-0.049, False), (0.051, True)):
        q, _, _ = rig.run(bound, rig.hold(0.0, 0.1), load, kp=0.0, kd=0.0)
        assert bool(np.any(q != 0.0)) == moves


def test_coulomb_friction_stops_a_free_joint_after_i_v_over_f():
    friction = {"coulomb_friction": {"torque_nm": 0.02}}
    _, v, _ = rig.run(friction, rig.hold(0.0, 0.2), v0=2.0, kp=0.0, kd=0.0)
    assert np.argmax(v == 0.0) * rig.DT == pytest.approx(0.1, abs=2e-3)
    assert np.all(v[110:] == 0.0)


def test_the_zone_of_friction_shrinks_with_the_gain_and_a_deadband_does_not():
    """The experiment that the catalogue names to distinguish the two."""
    effects = {
        "coulomb_friction": {"torque_nm": 0.04},
        "deadband": {"half_width_rad": 0.02},
    }
    widest = {}
    for name, params in effects.items():
        for kp in (2.0, 8.0):
            rest = rig.run({name: params}, rig.hold(0.0, 0.2), q0=0.0049, kp=kp)[0]
            rests = abs(rest[-1] - 0.0049) < 1e-6
            far = rig.run({name: params}, rig.hold(0.0, 0.2), q0=0.015, kp=kp)[0]
            widest[name, kp] = (rests, abs(far[-1] - 0.015) < 1e-6)
    assert widest["coulomb_friction", 2.0] == (True, True)
    assert widest["coulomb_friction", 8.0] == (True, False)
    assert widest["deadband", 2.0] == widest["deadband", 8.0] == (True, True)


def test_viscous_friction_decays_at_b_over_i():
    friction = {"viscous_friction": {"damping_nms": 0.01}}
    _, v, _ = rig.run(friction, rig.hold(0.0, 0.2), v0=1.0, kp=0.0, kd=0.0)
    rate = np.log1p(rig.DT * 0.01 / rig.INERTIA) / rig.DT  # implicit Euler, exactly
    assert -np.log(v[-1]) / 0.2 == pytest.approx(rate, rel=1e-3)
    assert rate == pytest.approx(0.01 / rig.INERTIA, rel=0.01)


def test_stribeck_friction_is_coulomb_friction_at_speeds_far_below_its_own():
    simple = rig.run({"coulomb_friction": {"torque_nm": 0.05}}, rig.jump(0.4, 0.3))
    full = {"stribeck_friction": {"extra_nm": 0.05, "speed_rad_s": 1e6}}
    assert rig.run(full, rig.jump(0.4, 0.3))[0] == pytest.approx(simple[0], abs=1e-5)
    falling = {"stribeck_friction": {"extra_nm": 0.05, "speed_rad_s": 0.1}}
    x = rig.run(falling, rig.hold(0.0, 0.01), v0=0.1, kp=0.0, kd=0.0)[2]
    assert x.friction[0] == pytest.approx(0.05 / np.e, rel=1e-5)


def test_load_friction_with_equal_shares_does_not_know_the_direction():
    """Torque τ against load −τ weighs the gears with 2 τ, either way."""
    for turn in (1.0, -1.0):
        params = {"drive_share": 0.1, "load_share": 0.1}
        load, target = -0.2 * turn, rig.hold(0.1 * turn, 0.01)
        x = rig.run({"load_friction": params}, target, load)[2]
        assert x.friction[0] == pytest.approx(0.1 * 0.4, rel=1e-4)
    one = {"drive_share": 0.1, "load_share": 0.0}
    x = rig.run({"load_friction": one}, target, 7.0)[2]
    assert x.friction == pytest.approx(0.1 * np.abs(x.torque), rel=1e-4)


def test_load_friction_holds_any_load_when_it_locks_itself():
    """A share of 1 is a gear that cannot be driven from its output."""
    params = {"load_friction": {"drive_share": 1.0, "load_share": 1.0}}
    for load in (0.01, 1.0):
        q, _, _ = rig.run(params, rig.hold(0.0, 0.1), load, kp=0.0, kd=0.0)
        assert np.all(q == 0.0)


def test_armature_slows_the_oscillation():
    extra = 3.0 * rig.INERTIA
    q, _, _ = rig.run(
        {"armature": {"inertia_kgm2": extra}}, rig.hold(0.0, 1.0), q0=0.1, kd=0.0
    )
    period = 2.0 * np.pi * np.sqrt(4.0 * rig.INERTIA / rig.KP)
    crossings = np.flatnonzero(np.diff(np.sign(q)) != 0)
    assert np.mean(np.diff(crossings)) * rig.DT == pytest.approx(period / 2, rel=0.01)


def test_an_offset_is_invisible_to_its_own_encoder():
    offset = {"encoder_offset": {"offset_rad": 0.04}}
    q, _, x = rig.run(offset, rig.hold(0.1, 0.6))
    assert q[-1] == pytest.approx(0.1 - 0.04, abs=1e-4)
    assert x.reading[-1] == pytest.approx(0.1, abs=1e-4)


def test_scale_divides_the_angle_and_multiplies_stiffness():
    q, _, x = rig.run({"encoder_scale": {"scale": 1.25}}, rig.hold(0.1, 0.6), 0.01)
    assert q[-1] == pytest.approx((0.1 + 0.01 / rig.KP) / 1.25, rel=1e-3)
    assert x.reading[-1] == pytest.approx(1.25 * q[-1], rel=1e-4)


def test_latency_ages_the_reading_and_leaves_the_servo_alone():
    plain = rig.run({}, rig.jump(0.3, 0.2))
    late = rig.run({"sensor_latency": {"latency_s": 0.01}}, rig.jump(0.3, 0.2))
    assert late[0] == pytest.approx(plain[0], abs=1e-6)
    assert late[2].reading[10:] == pytest.approx(plain[2].reading[:-10], abs=1e-6)
    assert np.max(np.abs(late[2].reading - plain[2].reading)) > 0.01


def swing():
    t = np.arange(500) * rig.DT
    return 0.3 * np.sin(12.0 * t)


@pytest.mark.parametrize(
    ("name", "key", "beside"),
    [
        ("asymmetric_friction", "difference_nm", "coulomb_friction"),
        ("asymmetric_viscous", "difference_nms", "viscous_friction"),
    ],
)
def test_asymmetry_changes_sides_in_the_mirror(name, key, beside):
    simple = {beside: {next(iter(CATALOGUE[beside].parameters)): 0.03}}
    right = rig.run({**simple, name: {key: 0.04}}, swing())[0]
    left = rig.run({**simple, name: {key: -0.04}}, -swing())[0]
    assert left == pytest.approx(-right, abs=1e-6)
    same = rig.run({**simple, name: {key: 0.04}}, -swing())[0]
    assert np.max(np.abs(same + right)) > 1e-3
    zero = rig.run({**simple, name: {key: 0.0}}, swing())[0]
    assert zero == pytest.approx(rig.run(simple, swing())[0], abs=1e-6)


def test_asymmetric_friction_holds_more_on_one_side():
    effects = {
        "coulomb_friction": {"torque_nm": 0.03},
        "asymmetric_friction": {"difference_nm": 0.02},
    }
    for load, moves in ((0.039, False), (0.041, True), (-0.019, False), (-0.021, True)):
        q, _, _ = rig.run(effects, rig.hold(0.0, 0.05), load, kp=0.0, kd=0.0)
        assert bool(np.any(q != 0.0)) == moves


def test_asymmetric_viscous_friction_has_two_slopes():
    effects = {
        "viscous_friction": {"damping_nms": 0.03},
        "asymmetric_viscous": {"difference_nms": 0.02},
    }
    for load, slope in ((0.1, 0.04), (-0.1, 0.02)):
        _, v, _ = rig.run(effects, rig.hold(0.0, 0.5), load, kp=0.0, kd=0.0)
        assert v[-1] == pytest.approx(load / slope, rel=1e-3)


def test_torque_slope_is_constant_whatever_the_step():
    for size in (0.5, 1.0):
        effects = {"torque_slope_limit": {"slope_nm_s": 5.0}}
        _, _, x = rig.run(effects, rig.jump(size, 0.05), kd=0.0)
        assert np.diff(x.torque)[1:20] / rig.DT == pytest.approx(5.0, rel=1e-3)


def test_eccentric_encoder_reports_the_speed_of_its_angle():
    params = {"sine_rad": 0.05, "cosine_rad": -0.03}
    _, _, x = rig.run({"encoder_eccentricity": params}, 5.0 * swing())
    found = np.diff(x.encoder) / rig.DT
    measured = x.encoder_speed[1:]
    assert found == pytest.approx(measured, abs=0.03)
    assert np.max(np.abs(np.diff(x.q) / rig.DT - measured)) > 0.1


GAP = {"backlash": {"gap_rad": 0.02}, "viscous_friction": {"damping_nms": 0.02}}


def test_backlash_lets_the_joint_be_pulled_through_its_gap():
    rests = [
        rig.run(GAP, rig.hold(0.0, 1.0), sign * 2e-3)[0][-1] for sign in (1.0, -1.0)
    ]
    assert rests[0] - rests[1] == pytest.approx(0.02 + 2 * 2e-3 / rig.KP, rel=0.02)


def test_backlash_stands_still_after_a_reversal_whatever_the_speed():
    for period_s in (1.0, 2.0):
        t = np.arange(rig.steps(3.0 * period_s)) * rig.DT
        triangle = 0.2 * np.abs(2.0 * ((t / period_s) % 1.0) - 1.0)
        sticky = {**GAP, "coulomb_friction": {"torque_nm": 0.01}}
        last = slice(rig.steps(2.0 * period_s), None)
        q = rig.run(sticky, triangle)[0][last]
        without = rig.run({**sticky, "backlash": {"gap_rad": 0.0}}, triangle)[0][last]
        lost = np.ptp(without) - np.ptp(q)
        assert lost == pytest.approx(0.02, rel=0.05)


def test_backlash_passes_no_torque_inside_the_gap():
    _, _, x = rig.run(GAP, rig.jump(0.3, 0.3))
    motor = x.encoder - x.q
    inside = np.abs(motor) < 0.0099
    assert np.any(inside)
    assert np.all(x.torque[inside] == 0.0)
    assert np.all(np.abs(motor) <= 0.01 + 1e-6)


def both_chains(effects, path, limit, dt=0.005):
    """Torques of chain and servo drive for the same targets, angles and speeds."""
    print("seed 3")
    rng = np.random.default_rng(3)
    inputs = jnp.asarray(rng.uniform(-1.0, 1.0, (200, 3, 20)), jnp.float32)
    model = tuple((CATALOGUE[name], p) for name, p in effects.items())
    rest = jnp.zeros(20)

    def step(states, row):
        ours, theirs = states
        target, q, qd = row
        joint = JointInput(target, q, qd, 0.0, 2.0, 0.2)
        ours, x = chain_step(model, ours, joint, dt)
        theirs, command = command_step(path, theirs, target, dt)
        torque = jnp.clip(3.0 * (command - q) - 0.1 * qd, -limit, limit)
        return (ours, theirs), (x.torque, torque)

    start = (init_states(model, rest, rest, dt), ServoDrive(path, 1, dt).begin(rest))
    ours, theirs = jax.lax.scan(step, start, inputs)[1]
    return np.max(np.abs(ours - theirs))


def test_six_effects_are_the_drive_of_the_hand():
    path = CommandPath(*(jnp.asarray(x) for x in (0.02, 3.0, 2.5)))
    effects = {
        "transport_delay": {"delay_s": 0.02},
        "lowpass_cutoff": {"cutoff_hz": 3.0},
        "slew_limit": {"speed_rad_s": 2.5},
        "stiffness": {"scale": 1.5},
        "damping": {"scale": 0.5},
        "torque_limit": {"limit_nm": 0.6},
    }
    assert both_chains(effects, path, 0.6) < 1e-5
    other = {**effects, "transport_delay": {"delay_s": 0.021}}
    assert both_chains(other, path, 0.6) > 1e-3


def test_priors_have_their_quantiles():
    for prior, one_off in ((lognormal(0.02, 3.0), 0.06), (normal(1.0, 0.5), 1.5)):
        center, off = (prior.log_density(x) for x in (prior.center, one_off))
        change = np.log(3.0) if prior.kind == "lognormal" else 0.0
        assert float(center - off) == pytest.approx(0.5 + change, rel=1e-5)
