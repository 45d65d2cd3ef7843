"""Each effect against a closed form, or as the limit of a simpler one: part two."""

import numpy as np
import pytest
from support import effects_rig as rig

G = 9.81


def test_thermal_derating_settles_where_heat_and_loss_balance():
    """A blocked joint under a constant error: τ' (1 + k τ'²) = kp e."""
    heat = {"thermal_derating": {"loss_per_nm2": 2.0, "time_constant_s": 1.0}}
    _, _, x = rig.run(heat, rig.hold(0.5, 6.0), load=0.0, kp=1.0, kd=0.0, q0=0.0)
    blocked = {"coulomb_friction": {"torque_nm": 10.0}}
    _, _, x = rig.run({**heat, **blocked}, rig.hold(0.5, 8.0), kp=1.0, kd=0.0)
    left = x.effort[-1]
    assert left * (1.0 + 2.0 * left**2) == pytest.approx(0.5, rel=1e-3)
    assert x.effort[0] == pytest.approx(0.5)
    third = x.effort[rig.steps(1.0)]
    assert left < third < 0.5


def test_a_cold_motor_is_the_plain_one():
    slow = {"thermal_derating": {"loss_per_nm2": 2.0, "time_constant_s": 1e9}}
    found, plain = (rig.run(e, rig.jump(0.4, 0.2))[0] for e in (slow, {}))
    assert found == pytest.approx(plain, abs=1e-6)


def test_a_limit_of_each_direction():
    """Steps up and down take their own times; alike both are the plain limit."""
    target = np.concatenate([rig.jump(1.0, 0.6), rig.hold(0.0, 0.6)])
    slews = {"directional_slew": {"up_rad_s": 2.0, "down_rad_s": 5.0}}
    command = rig.run(slews, target)[2].command
    speed = np.diff(command) / rig.DT
    assert speed.max() == pytest.approx(2.0, rel=1e-3)
    assert speed.min() == pytest.approx(-5.0, rel=1e-3)
    alike = {"directional_slew": {"up_rad_s": 2.0, "down_rad_s": 2.0}}
    plain = rig.run({"slew_limit": {"speed_rad_s": 2.0}}, target)[0]
    assert rig.run(alike, target)[0] == pytest.approx(plain, abs=1e-6)
    assert np.max(np.abs(rig.run(slews, target)[0] - plain)) > 0.1


def test_a_start_torque_jumps_beyond_a_small_error():
    """Of a blocked joint: kp e, and S more from e₀ on, both ways."""
    start = {"start_torque": {"torque_nm": 0.3, "from_rad": 0.05}}
    blocked = {"coulomb_friction": {"torque_nm": 10.0}}
    for error in (0.03, 0.07, -0.04, -0.2):
        x = rig.run({**start, **blocked}, rig.hold(error, 0.01))[2]
        more = 0.3 * np.sign(error) if abs(error) > 0.05 else 0.0
        assert x.effort[0] == pytest.approx(rig.KP * error + more, rel=1e-5)


def test_a_start_torque_overcomes_friction_that_holds_without_it():
    """A servo that would rest in its zone of friction comes as near as e₀."""
    friction = {"coulomb_friction": {"torque_nm": 0.1}}
    start = {"start_torque": {"torque_nm": 0.09, "from_rad": 0.002}}
    rests = rig.run(friction, rig.jump(0.2, 3.0))[0][-1]
    comes = rig.run({**start, **friction}, rig.jump(0.2, 3.0))[0][-1]
    assert abs(0.2 - rests) > 0.02
    assert abs(0.2 - comes) < 0.008


def test_supply_sag_knows_the_sum_of_all_efforts():
    sag = {"supply_sag": {"sag_per_nm": 0.4}}
    for others in (0.0, 3.0):
        around = rig.AROUND.replace(others_nm=others)
        _, _, x = rig.run(sag, rig.hold(0.5, 0.01), around=around)
        asked = rig.KP * 0.5
        expected = asked / (1.0 + 0.4 * (asked + others))
        assert x.effort[0] == pytest.approx(expected, rel=1e-5)


def test_a_sagging_servo_follows_with_the_slope_of_its_torque():
    """A joint that asks for more lowers its own share too: d(τ left) / dτ < left."""
    sag = {"supply_sag": {"sag_per_nm": 0.4}}
    around = rig.AROUND.replace(others_nm=1.0)
    angles = (0.5, 0.51)
    near = [rig.run(sag, rig.hold(a, 0.01), around=around)[2] for a in angles]
    slope = (near[1].effort[0] - near[0].effort[0]) / (rig.KP * (angles[1] - angles[0]))
    follows = 0.5 * (near[0].follows[0] + near[1].follows[0])
    assert follows == pytest.approx(slope, rel=1e-3)


def test_weakness_is_a_scale_of_gains_and_limit():
    effects = {"torque_limit": {"limit_nm": 0.3}, "finger_weakness": {"strength": 0.5}}
    weak = rig.run(effects, rig.jump(0.6, 0.3))[0]
    scaled = {
        "stiffness": {"scale": 0.5},
        "damping": {"scale": 0.5},
        "torque_limit": {"limit_nm": 0.15},
    }
    same = rig.run(scaled, rig.jump(0.6, 0.3))[0]
    assert weak == pytest.approx(same, abs=1e-6)
    assert np.max(np.abs(weak - rig.run({}, rig.jump(0.6, 0.3))[0])) > 0.05


def spring(c, j=3e-4):
    return {"compliance": {"compliance_rad_nm": c, "motor_inertia_kgm2": j}}


def test_a_spring_gives_way_in_proportion_to_the_load():
    """The encoder sits at the motor: the joint droops by (1/kp + C) τ."""
    for load in (0.05, -0.1):
        q, _, x = rig.run(spring(0.3), rig.hold(0.0, 1.0), load)
        assert q[-1] == pytest.approx(load * (1.0 / rig.KP + 0.3), rel=0.01)
        assert x.encoder[-1] == pytest.approx(load / rig.KP, rel=0.01)
        assert x.effort[-1] == pytest.approx(-load, rel=0.01)


def test_a_motor_without_inertia_is_a_spring_in_series_with_the_gain():
    """kd = 0: kp and 1/C in series, at once."""
    q, _, _ = rig.run(
        spring(0.5, 0.0), rig.hold(0.0, 1.0, 1e-4), q0=0.1, kd=0.0, dt=1e-4
    )
    stiffness = 1.0 / (1.0 / rig.KP + 0.5)
    period = 2.0 * np.pi * np.sqrt(rig.INERTIA / stiffness)
    crossings = np.flatnonzero(np.diff(np.sign(q)) != 0)
    assert np.mean(np.diff(crossings)) * 1e-4 == pytest.approx(period / 2, rel=0.01)


def test_motor_and_joint_swing_against_each_other():
    """Without a drive: ω² = (1/J + 1/(I − J)) / C about the common motion."""
    c, j, dt = 0.02, 4e-4, 2e-5
    push = np.where(np.arange(10000) < 50, 1.0, 0.0)
    _, v, _ = rig.run(spring(c, j), np.zeros(10000), push, kp=0, kd=0, dt=dt)
    mean = 1.0 * 50 * dt / rig.INERTIA
    crossings = np.flatnonzero(np.diff(np.sign(v - mean)) != 0)
    crossings = crossings[crossings > 50][:8]
    omega = np.sqrt((1.0 / j + 1.0 / (rig.INERTIA - j)) / c)
    found = np.pi / (np.mean(np.diff(crossings)) * dt)
    assert found == pytest.approx(omega, rel=0.02)
    # And the less the longer: ζ' = ζ √(I / (I − J)) of what swings.
    parts = np.split(np.abs(v - mean), crossings)[1:-1]
    ratio = 0.1 * np.sqrt(rig.INERTIA / (rig.INERTIA - j))
    decrement = np.pi * ratio / np.sqrt(1.0 - ratio**2)
    falls = -np.diff(np.log([part.max() for part in parts]))
    assert falls == pytest.approx(decrement, rel=0.1)


def test_a_spring_gives_no_more_energy_than_it_got():
    """Joint, motor and spring together, at coarse substeps too."""
    c, j = 0.05, 4e-4
    for dt in (1e-4, 1e-3, 5e-3):
        push = np.where(np.arange(rig.steps(0.5, dt)) < 3, 1.0, 0.0)
        x = rig.run(spring(c, j), np.zeros(len(push)), push, kp=0, kd=0, dt=dt)[2]
        free = slice(4, None)
        speed, motor = x.qd[free], x.encoder_speed[free]
        force = (x.encoder - x.q)[free] / c
        energy = (rig.INERTIA - j) * speed**2 + j * motor**2 + c * force**2
        assert np.all(np.diff(energy) <= 1e-5 * energy[0])
        assert energy[0] > 0.0


def dahl(torque=0.05, reach=0.02):
    return {"hysteresis": {"torque_nm": torque, "range_rad": reach}}


def test_hysteresis_is_a_spring_at_first_and_friction_in_the_end():
    """From rest z = 1 − exp(−x/d): slope F/d, then the constant F."""
    q, _, x = rig.run(dahl(), rig.hold(0, 1.0), v0=0.1, kp=0, kd=10.0, load=1.0)
    expected = -0.05 * (1.0 - np.exp(-(x.q + x.qd * rig.DT) / 0.02))
    assert x.passive == pytest.approx(expected, abs=1e-3)
    assert x.passive[-1] == pytest.approx(-0.05, rel=0.01)
    assert q[-1] > 0.09


def test_hysteresis_with_a_short_range_is_coulomb_friction():
    t = np.arange(1000) * rig.DT
    target = 0.3 * np.sin(6.0 * t)
    simple = rig.run({"coulomb_friction": {"torque_nm": 0.05}}, target)[0]
    short, wide = (rig.run(dahl(reach=d), target)[0] for d in (5e-4, 0.2))
    assert np.max(np.abs(short - simple)) < 2e-3
    assert np.max(np.abs(wide - simple)) > 5e-3


def test_hysteresis_does_not_know_the_speed_of_a_loop():
    """Twice as slow, the same torque over the angle; the loop has an area."""
    loops = []
    for period_s in (1.0, 2.0):
        t = np.arange(rig.steps(2 * period_s)) * rig.DT
        target = 0.05 * np.sin(2 * np.pi * t / period_s)
        x = rig.run(dahl(), target, kp=500.0, kd=20.0)[2]
        last = slice(rig.steps(period_s), None)
        loops.append(np.sum(x.passive[last] * x.qd[last]) * rig.DT)
    assert loops[0] < -5e-3
    assert loops[1] == pytest.approx(loops[0], rel=0.05)


def follow(speeds, dt, reach=0.02):
    """The bend of a Dahl spring that has followed the angles of these speeds."""
    bends, way = [0.0], np.sign(speeds)
    for w, v in zip(way, speeds, strict=True):
        bends.append(w + (bends[-1] - w) * np.exp(-abs(v) * dt / reach))
    return np.array(bends[1:])


def test_hysteresis_gives_no_more_energy_than_it_got():
    for dt in (1e-3, 5e-3):
        for speed in (0.3, 5.0):
            v = rig.run(dahl(), rig.hold(0, 0.5, dt), v0=speed, kp=0, kd=0, dt=dt)[1]
            bend = follow(np.append(speed, v), dt)
            store = 0.5 * 0.05 * 0.02 * bend**2
            energy = 0.5 * rig.INERTIA * np.append(speed, v) ** 2 + store
            first = 0.5 * rig.INERTIA * speed**2
            assert np.all(np.diff(energy) <= 1e-6 * first)
            assert energy[-1] < 0.9 * first


def test_coupling_pulls_by_angle_and_effort_of_the_other_joint():
    pull = {"joint_coupling": {"stiffness_nm_rad": 0.3, "effort_share": 0.1}}
    q, _, x = rig.run(pull, rig.hold(0.0, 1.0))
    torque = 0.3 * 0.2 + 0.1 * 0.1
    assert x.passive[-1] == pytest.approx(torque, rel=1e-5)
    assert q[-1] == pytest.approx(torque / rig.KP, rel=0.01)


def test_mutual_coupling_is_a_spring_between_two_joints():
    """With one κ both ways the pair has a potential; one way alone is driven."""
    import jax
    import jax.numpy as jnp

    from envs.actuator.catalogue import CATALOGUE
    from envs.actuator.chain import JointInput, chain_step, init_states
    from envs.actuator.joint import joint_step
    from envs.actuator.surroundings import Surroundings

    def gain(stiffness):
        params = {"stiffness_nm_rad": stiffness, "effort_share": jnp.zeros(2)}
        model = ((CATALOGUE["joint_coupling"], params),)
        zero = jnp.zeros(2)

        def step(carry, _):
            q, v = carry
            around = Surroundings(other_q=q[::-1], other_nm=zero)
            joint = JointInput(zero, q, v, 0.0, 0.0, 0.0, around)
            _, x = chain_step(model, ((),), joint, 1e-4)
            x = x.replace(load=-2.0 * q)  # a spring of each joint's own
            q, v = joint_step(x, rig.INERTIA, 1e-4)
            potential = jnp.sum(q**2) - stiffness[0] * q[0] * q[1]
            return (q, v), 0.5 * rig.INERTIA * jnp.sum(v**2) + potential

        assert init_states(model, zero, zero, 1e-4) == ((),)
        start = (jnp.array([0.0, 0.1]), zero)
        energy = jax.lax.scan(step, start, length=4000)[1]
        return float(jnp.max(jnp.abs(energy / energy[0] - 1.0)))

    assert gain(jnp.array([0.5, 0.5])) < 0.02
    assert gain(jnp.array([0.5, 0.0])) > 0.05


def test_drift_ages_the_reading_more_and_more():
    t = np.arange(2000) * rig.DT
    target = 0.2 * np.sin(3.0 * t)
    plain = rig.run({}, target)[2].reading
    for ppm in (2000.0, -2000.0):
        found = rig.run({"clock_drift": {"drift_ppm": ppm}}, target)[2].reading
        expected = np.interp(t - 1e-6 * ppm * (t + rig.DT), t, plain)
        inside = slice(100, -10)
        assert found[inside] == pytest.approx(expected[inside], abs=2e-5)
        assert np.max(np.abs(found - plain)) > 5e-4


def test_payload_droops_by_its_weight_and_slows_by_its_inertia():
    mass = {"payload_mass": {"mass_kg": 0.05}}
    q, _, x = rig.run(mass, rig.hold(0.0, 1.0))
    weight = 0.05 * G * 0.05  # lever 0.05 m; about +y, a mass at +x pulls forward
    assert q[-1] == pytest.approx(weight / rig.KP, rel=0.01)
    assert x.inertia[-1] == pytest.approx(0.05 * (0.05**2 + 0.02**2), rel=1e-5)


def test_a_shifted_payload_turns_by_its_nominal_weight():
    shift = {"payload_com": {"x_m": 0.01, "y_m": 0.3, "z_m": -0.02}}
    load = rig.run(shift, rig.hold(0.0, 0.01))[2].load
    assert load[-1] == pytest.approx(0.1 * G * 0.01, rel=1e-4)  # along the axis: none


def test_a_payload_further_out_is_harder_to_turn():
    shift = {"payload_com": {"x_m": 0.01, "y_m": 0.3, "z_m": -0.02}}
    x = rig.run(shift, rig.hold(0.0, 0.01))[2]
    moved = np.cross(rig.AXIS, rig.ARM + np.array([0.01, 0.3, -0.02]))
    expected = 0.1 * (moved @ moved - np.sum(np.cross(rig.AXIS, rig.ARM) ** 2))
    assert x.inertia[-1] == pytest.approx(expected, rel=1e-4)


def test_tilt_turns_all_gravity_and_leaves_its_size():
    for angle in (0.1, -0.3):
        x = rig.run(
            {"mount_tilt": {"roll_rad": 0.0, "pitch_rad": angle}}, rig.hold(0, 0.01)
        )[2]
        # In a mount pitched by a, gravity is (g sin a, 0, −g cos a).
        gravity = G * np.array([np.sin(angle), 0.0, -np.cos(angle)])
        moment = 0.2 * np.cross(rig.AXIS, rig.ARM)
        expected = moment @ (gravity - np.array([0.0, 0.0, -G]))
        assert x.load[-1] == pytest.approx(expected, rel=1e-3)


def test_a_tilt_also_turns_the_weight_of_a_heavier_payload():
    both = {
        "mount_tilt": {"roll_rad": 0.0, "pitch_rad": np.pi / 2 - 1e-3},
        "payload_mass": {"mass_kg": 0.1},
    }
    tilt = {"mount_tilt": both["mount_tilt"]}
    loads = [rig.run(e, rig.hold(0.0, 0.01))[2].load[-1] for e in (both, tilt)]
    # Gravity along +x acts on the lever of 0.02 m along z.
    assert loads[0] - loads[1] == pytest.approx(0.1 * G * 0.02, rel=0.01)
