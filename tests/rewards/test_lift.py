"""The lift objective against the theory of its moving average, phase and gate."""

import itertools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import rewards

PARAMS = rewards.LiftParams()
SPEEDS = [0.0, 0.01, 0.02, 0.09, 0.16, 0.5]
FREQUENCIES = [1.0, 1.0, 1.0, 2.25, 3.5, 3.5]
TURN = 2.0 * np.pi


@jax.jit
def rollout(memory, tip_vel_z, tip_force_n, command_planar, dt_s):
    """Memories and magnitudes of all steps."""

    def step(memory, inputs):
        memory, magnitude = rewards.lift_step(memory, *inputs, dt_s, PARAMS)
        return memory, (memory, magnitude)

    return jax.lax.scan(step, memory, (tip_vel_z, tip_force_n, command_planar))[1]


def commands(speed, steps):
    return jnp.tile(jnp.array([speed, 0.0]), (steps, 1))


def test_frequency_is_linear_between_its_clamps():
    found = [rewards.lift_frequency_hz(jnp.asarray(s), PARAMS) for s in SPEEDS]
    np.testing.assert_allclose(found, FREQUENCIES, rtol=1e-6)


def average_of_sinusoid(t, amplitude, psi, f_tip, f_phase, dt, tau):
    """z_t of u = A cos(2π f_tip t Δt + ψ) from rest, in closed form.

    u e^{−iφ} is a line at the difference and one at the (negative) sum frequency. Each
    passes H(e^{jω}) = α/(1 − (1−α) e^{−jω}) and starts a transient (1−α)^t that brings
    z_0 to 0.
    """
    alpha = dt / (dt + tau)
    average = np.zeros_like(t, dtype=complex)
    for sign in (1.0, -1.0):
        omega = TURN * (sign * f_tip - f_phase) * dt
        gain = alpha / (1.0 - (1.0 - alpha) * np.exp(-1j * omega))
        line = 0.5 * amplitude * np.exp(1j * sign * psi) * gain
        average += line * (np.exp(1j * omega * t) - (1.0 - alpha) ** t)
    return average


@pytest.mark.parametrize("ratio", [1.0, 0.5, 2.0])
def test_average_equals_the_analytic_answer(ratio, rng, x64):
    t = np.arange(1, 401)
    for _ in range(5):
        dt, speed = rng.uniform(0.002, 0.04), rng.uniform(0.0, 0.2)
        amplitude, psi = rng.uniform(0.01, 0.1, 5), rng.uniform(0.0, TURN, 5)
        f = np.interp(speed, [0.02, 0.16], [1.0, 3.5])
        u = amplitude * np.cos(TURN * ratio * f * t[:, None] * dt + psi)
        inputs = jnp.asarray(u), jnp.zeros((400, 5)), commands(speed, 400)
        memory, _ = rollout(rewards.init_lift_memory(), *inputs, dt)
        found = np.asarray(memory.average[..., 0] + 1j * memory.average[..., 1])
        for j in range(5):
            expected = average_of_sinusoid(
                t, amplitude[j], psi[j], ratio * f, f, dt, 0.3
            )
            np.testing.assert_allclose(found[:, j], expected, atol=1e-10)
            detuned = average_of_sinusoid(
                t, amplitude[j], psi[j], 1.1 * ratio * f, f, dt, 0.3
            )
            assert np.abs(found[:, j] - detuned).max() > 1e-5


def test_matched_swing_settles_at_half_its_amplitude_and_its_phase(x64):
    """Gain 1/2 and phase ψ at f; well below at 0.5 f and 2 f."""
    t, dt, f, psi = np.arange(1, 2001), 0.02, 2.25, 0.7
    level = {}
    for ratio in (1.0, 0.5, 2.0):
        u = 0.02 * np.cos(TURN * ratio * f * t[:, None] * dt + psi) * np.ones(5)
        inputs = jnp.asarray(u), jnp.zeros((2000, 5)), commands(0.09, 2000)
        memory, _ = rollout(rewards.init_lift_memory(), *inputs, dt)
        # 400 steps are 18 whole cycles: the ripple at the other frequencies cancels
        level[ratio] = np.asarray(memory.average[-400:, 0].mean(axis=0))
    np.testing.assert_allclose(
        level[1.0], 0.01 * np.array([np.cos(psi), np.sin(psi)]), atol=1e-9
    )
    np.testing.assert_allclose([level[0.5], level[2.0]], 0.0, atol=1e-9)


def test_full_magnitude_is_z_max_for_each_open_gate(rng):
    open_gates = rng.random(5) < 0.5
    memory = rewards.init_lift_memory().replace(
        average=jnp.full((5, 2), 1.0), touched=jnp.asarray(open_gates)
    )
    _, magnitude = rewards.lift_step(
        memory, jnp.zeros(5), jnp.zeros(5), jnp.array([0.1, 0.0]), 0.02, PARAMS
    )
    assert magnitude == pytest.approx(0.015 * open_gates.sum(), abs=1e-7)


def test_magnitude_grows_with_the_average():
    levels = jnp.linspace(0.0, 0.02, 41)

    @jax.jit
    @jax.vmap
    def magnitude(level):
        average = jnp.stack([jnp.full(5, level), jnp.zeros(5)], axis=-1)
        memory = rewards.LiftMemory(jnp.zeros(()), average, jnp.ones(5, bool))
        still = jnp.zeros(5)
        return rewards.lift_step(
            memory, still, still, jnp.array([0.1, 0.0]), 0.02, PARAMS
        )[1]

    values = np.asarray(magnitude(levels))
    kept = np.asarray(levels) * (1.0 - 0.02 / 0.32)
    assert (np.diff(values) >= 0.0).all()
    assert (values[kept < 0.005] == 0.0).all()
    assert (np.diff(values[(kept > 0.005) & (kept < 0.015)]) > 0.0).all()
    np.testing.assert_allclose(values[kept > 0.015], 5 * 0.015, rtol=1e-6)


@pytest.mark.parametrize(
    ("airborne", "touched", "commanded"),
    list(itertools.product([False, True], repeat=3)),
)
def test_gate_truth_table(airborne, touched, commanded):
    just_below = np.nextafter(0.15, 0.0, dtype=np.float32)
    force = jnp.full(5, just_below if airborne else 0.15)
    command = jnp.array([0.02 if commanded else 0.0199, 0.0])
    memory = rewards.LiftMemory(
        jnp.zeros(()), jnp.full((5, 2), 1.0), jnp.full(5, touched)
    )
    _, magnitude = rewards.lift_step(memory, jnp.zeros(5), force, command, 0.02, PARAMS)
    gate = rewards.lift_gate(force, memory.touched, command, PARAMS)
    assert (gate == (airborne and touched and commanded)).all()
    assert (magnitude > 0.0) == (airborne and touched and commanded)


@pytest.mark.parametrize("touched", [False, True])
@pytest.mark.parametrize("wraps", [False, True])
@pytest.mark.parametrize("contact", [False, True])
def test_contact_memory_truth_table(touched, wraps, contact):
    """A wrap clears first, then this step's contact is entered."""
    memory = rewards.init_lift_memory().replace(
        phase=jnp.asarray(TURN - 0.01 if wraps else 1.0), touched=jnp.full(5, touched)
    )
    force = jnp.full(5, 1.0 if contact else 0.0)
    after, _ = rewards.lift_step(
        memory, jnp.zeros(5), force, jnp.array([0.1, 0.0]), 0.02, PARAMS
    )
    assert (after.touched == (contact or (touched and not wraps))).all()


def test_wraps_are_the_whole_turns_of_the_total_phase(rng, x64):
    speed, dt = rng.uniform(0.0, 0.2, 400), rng.uniform(0.005, 0.03)
    command = np.stack([speed, np.zeros(400)], axis=-1)
    force = np.zeros((400, 5))
    force[0] = 1.0
    memory, _ = rollout(
        rewards.init_lift_memory(),
        jnp.zeros((400, 5)),
        jnp.asarray(force),
        jnp.asarray(command),
        dt,
    )
    f = np.interp(speed, [0.02, 0.16], [1.0, 3.5])
    turns = np.cumsum(f * dt)
    phase = np.asarray(memory.phase)
    assert ((phase >= 0.0) & (phase < TURN)).all()
    assert (np.diff(phase) < 0.0).sum() == np.floor(turns[-1])
    np.testing.assert_allclose(phase, TURN * (turns % 1.0), atol=1e-9)
    np.testing.assert_array_equal(memory.touched[:, 0], turns < 1.0)


def test_phase_goes_on_below_the_dead_speed():
    memory, magnitude = rollout(
        rewards.init_lift_memory(),
        jnp.ones((25, 5)),
        jnp.zeros((25, 5)),
        commands(0.0, 25),
        0.02,
    )
    assert memory.phase[-1] == pytest.approx(TURN * 0.5, rel=1e-5)
    assert not magnitude.any()


def test_reset_leaves_nothing_behind(rng):
    first, second = rng.normal(size=(2, 60, 5)) * 0.1
    force = jnp.asarray(rng.random((60, 5)) < 0.4, float)
    used, _ = rollout(
        rewards.init_lift_memory(), jnp.asarray(first), force, commands(0.1, 60), 0.02
    )
    last = jax.tree.map(lambda x: x[-1], used)
    reset = jax.tree.map(
        lambda new, old: jnp.where(True, new, old), rewards.init_lift_memory(), last
    )
    inputs = jnp.asarray(second), force, commands(0.12, 60), 0.02
    fresh = rollout(rewards.init_lift_memory(), *inputs)
    for found, expected in zip(
        jax.tree.leaves(rollout(reset, *inputs)), jax.tree.leaves(fresh), strict=True
    ):
        np.testing.assert_array_equal(found, expected)
    carried_on = rollout(last, *inputs)
    assert np.abs(carried_on[0].average - fresh[0].average).max() > 1e-4


def test_memory_keeps_its_types_and_shapes():
    step = jax.jit(rewards.lift_step)
    for tips in (1, 4):
        memory = rewards.init_lift_memory(tips)
        ones = jnp.ones(tips)
        after, _ = step(memory, ones, ones, jnp.ones(2), 0.02, PARAMS)
        types = [(x.shape, x.dtype) for x in jax.tree.leaves(memory)]
        assert types == [(x.shape, x.dtype) for x in jax.tree.leaves(after)]
