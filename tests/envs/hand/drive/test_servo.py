import dataclasses
from functools import partial

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest

from envs.actuator.catalogue import CATALOGUE
from envs.actuator.chain import JointInput, chain_step
from envs.errors import InputError
from envs.hand.drive.servo import CommandPath, ServoDrive, command_step, servo_drive
from envs.hand.hand_file import load_hand_file
from envs.hand.model import build_model
from envs.hand.nominal import vendor_hand

DT = 0.005
SEED = 20260103
JOINTS = 20


def sequence(n_substeps):
    """Commands of one control step of the default hand, and its drive."""
    drive = servo_drive(load_hand_file(), n_substeps, DT)
    return drive, jax.jit(drive.commands)


def make(delay_s=0.0, lowpass_hz=np.inf, speed_limit=np.inf) -> CommandPath:
    """A command path in which every stage is at its identity unless given."""
    limits = jnp.full(JOINTS, speed_limit)
    return CommandPath(jnp.asarray(delay_s), jnp.asarray(lowpass_hz), limits)


def respond(params: CommandPath, targets: np.ndarray, dt: float = DT) -> np.ndarray:
    """Commands for a sequence of scalar targets, sent to all joints from rest at 0."""
    state = ServoDrive(params, 1, dt).begin(jnp.zeros(JOINTS))
    sent = jnp.asarray(targets)[:, None] * jnp.ones(JOINTS)
    return np.asarray(_scan(params, state, sent, dt))


@partial(jax.jit, static_argnames="dt")
def _scan(params, state, sent, dt):
    def step(state, target):
        return command_step(params, state, target, dt)

    return jax.lax.scan(step, state, sent)[1]


def random_targets(count: int) -> np.ndarray:
    print(f"seed {SEED}")
    return np.random.default_rng(SEED).uniform(-1, 1, count)


@pytest.mark.parametrize("dt", [0.005, 0.002, 0.001])
@pytest.mark.parametrize("cutoff_hz", [3.0, 15.0])
def test_step_response_is_the_exact_exponential_at_any_substep(dt, cutoff_hz):
    commands = respond(make(lowpass_hz=cutoff_hz), np.ones(200), dt)
    time_s = dt * np.arange(1, 201)
    expected = 1 - np.exp(-2 * np.pi * cutoff_hz * time_s)
    np.testing.assert_allclose(commands[:, 0], expected, atol=2e-6)


def test_backward_euler_would_not_pass():
    """Negative control: the vendor's fallback factor is visibly slower."""
    rc = 1 / (2 * np.pi * 3.0)
    k = np.arange(1, 201)
    euler = 1 - (1 - DT / (DT + rc)) ** k
    exact = respond(make(lowpass_hz=3.0), np.ones(200))[:, 0]
    assert np.max(np.abs(euler - exact)) > 0.01


@pytest.mark.parametrize(("ratio", "gain"), [(1.0, 0.5**0.5), (0.5, 0.8**0.5)])
def test_gain_and_phase_of_the_low_pass(ratio, gain):
    """1/(1 + i f/f_c) times the hold of the target, which leads by half a substep."""
    dt, cutoff_hz = 0.001, 5.0
    frequency = ratio * cutoff_hz
    phase = 2 * np.pi * frequency * dt * np.arange(4000)
    response = respond(make(lowpass_hz=cutoff_hz), np.sin(phase), dt)[:, 0]
    settled = slice(2000, 4000)  # whole periods
    transfer = 2j * np.mean(response[settled] * np.exp(-1j * phase[settled]))
    expected = 1 / (1 + 1j * ratio) * np.exp(1j * np.pi * frequency * dt)
    assert abs(transfer) == pytest.approx(gain, rel=2e-3)
    assert np.angle(transfer) == pytest.approx(np.angle(expected), abs=2e-3)


@pytest.mark.parametrize("slots", [0, 1, 4, 8])
def test_whole_slot_delay_is_a_shift(slots):
    targets = random_targets(50)
    commands = respond(make(delay_s=slots * DT), targets)[:, 0]
    np.testing.assert_allclose(
        commands[slots:], targets[: 50 - slots], rtol=1e-6, atol=1e-6
    )
    np.testing.assert_array_equal(commands[:slots], 0.0)


@pytest.mark.parametrize("delay_s", [0.0012, 0.0033, 0.019, 0.0399])
def test_fractional_delay_interpolates_and_is_exact_on_ramps(delay_s):
    time_s = DT * np.arange(60)
    commands = respond(make(delay_s=delay_s), time_s)[:, 0]
    np.testing.assert_allclose(commands[9:], time_s[9:] - delay_s, atol=2e-6)


def test_neighbouring_delay_would_not_pass():
    """Negative control: a millisecond is distinguished."""
    time_s = DT * np.arange(60)
    commands = respond(make(delay_s=0.018), time_s)[:, 0]
    assert np.min(np.abs(commands[9:] - (time_s[9:] - 0.019))) > 5e-4


def test_one_control_step_delay_is_four_substeps():
    drive, commands = sequence(4)
    state, first = commands(drive.begin(jnp.zeros(JOINTS)), jnp.ones(JOINTS))
    _, second = commands(state, jnp.ones(JOINTS))
    np.testing.assert_allclose(first, 0.0, atol=1e-6)
    assert np.all(np.asarray(second[0]) > 0.01)


def test_speed_limit_is_reached_and_never_exceeded():
    limits = np.linspace(1.0, 3.0, JOINTS)
    params = make(lowpass_hz=3.0).replace(speed_limit=jnp.array(limits))
    commands = respond(params, 5 * random_targets(400))
    speed = np.abs(np.diff(commands, axis=0)) / DT
    assert np.all(speed <= limits * (1 + 1e-4))
    assert np.all(np.max(speed, axis=0) >= limits * (1 - 1e-4))
    unlimited = respond(make(lowpass_hz=3.0), 5 * random_targets(400))
    assert np.max(np.abs(np.diff(unlimited, axis=0)) / DT) > 3.5


def test_command_arrives_after_a_limited_move():
    commands = respond(make(lowpass_hz=3.0, speed_limit=2.5), np.ones(400))[:, 0]
    assert np.all(np.diff(commands) >= 0)
    assert commands[-1] == pytest.approx(1.0, abs=1e-5)
    ramp = np.flatnonzero(np.diff(commands) / DT > 2.5 * (1 - 1e-4))
    assert len(ramp) > 40


def test_identity_values_pass_the_target_through():
    targets = random_targets(30)
    commands = respond(make(), targets)
    np.testing.assert_allclose(commands[:, 7], targets, atol=2e-7)


def test_a_drive_at_rest_stays_at_rest():
    drive, sent = sequence(50)
    rest = jnp.asarray(np.random.default_rng(SEED).uniform(-1, 1, JOINTS), jnp.float32)
    state = drive.begin(rest)
    later, commands = sent(state, rest)
    np.testing.assert_array_equal(commands, jnp.broadcast_to(rest, (50, JOINTS)))
    for left, was in zip(*map(jax.tree.leaves, (later, state)), strict=True):
        np.testing.assert_array_equal(left, was)


def test_reset_leaves_nothing_behind():
    drive, sent = sequence(20)
    start, far = jnp.zeros(JOINTS), jnp.full(JOINTS, 2.0)
    fresh = drive.begin(start)
    used, _ = sent(fresh, far)
    _, expected = sent(fresh, start)
    _, commands = sent(drive.begin(start), start)
    np.testing.assert_array_equal(commands, expected)
    _, leaked = sent(used, start)
    assert np.max(np.abs(np.asarray(leaked - expected))) > 0.01


def test_sequence_is_the_repeated_step():
    drive, sent = sequence(7)
    state, target = drive.begin(jnp.zeros(JOINTS)), jnp.full(JOINTS, 0.4)
    end, commands = sent(state, target)
    step = jax.jit(command_step, static_argnames="dt")
    for k in range(7):
        state, command = step(drive.path, state, target, dt=DT)
        np.testing.assert_allclose(command, commands[k], atol=1e-7)
    for one, other in zip(*map(jax.tree.leaves, (state, end)), strict=True):
        np.testing.assert_allclose(one, other, atol=1e-7)


def _nominal() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    figure = vendor_hand()
    return tuple(figure.per_joint(name) for name in ("kp", "kv", "force_limit"))


def test_parameters_are_the_nominal_ones_times_the_scales():
    kp, kv, force = _nominal()
    hand = load_hand_file()
    gains = _gains(build_model(hand))
    np.testing.assert_allclose(gains[0], 18.7 * kp, rtol=1e-6)
    np.testing.assert_allclose(gains[1], np.sqrt(18.7) * kv, rtol=1e-6)
    np.testing.assert_allclose(gains[2], force, rtol=1e-6)
    assert float(servo_drive(hand, 4, DT).path.delay_s) == pytest.approx(0.02)
    slow = dataclasses.replace(hand.delay_s, value=0.05)
    with pytest.raises(InputError, match="delay_s"):
        servo_drive(dataclasses.replace(hand, delay_s=slow), 4, DT)


def _gains(model: mujoco.MjModel) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Position gains, velocity gains and torque limits of a model's servos."""
    limits = model.actuator_forcerange[:, 1]
    return model.actuator_gainprm[:, 0], -model.actuator_biasprm[:, 2], limits


def _servo_torque(kp, kd, limit, command, q, qd):
    """Torque of the actuator chain with a torque limit as its only effect."""
    joint = JointInput(command, q, qd, 0.0, jnp.asarray(kp), jnp.asarray(kd))
    model = ((CATALOGUE["torque_limit"], {"limit_nm": jnp.asarray(limit)}),)
    return chain_step(model, ((),), joint, DT)[1].torque


def _mujoco_servo(gains) -> mujoco.MjModel:
    """Twenty free hinges with the actuators that the documentation names."""
    bodies, actuators = "", ""
    for j in range(JOINTS):
        kp, kd, limit = (float(x[j]) for x in gains)
        bodies += (
            f'<body><joint name="j{j}" axis="0 1 0"/>'
            '<geom size="0.01" mass="0.1" contype="0"/></body>'
        )
        actuators += (
            f'<general joint="j{j}" biastype="affine" gainprm="{kp!r}" '
            f'biasprm="0 {-kp!r} {-kd!r}" forcelimited="true" '
            f'forcerange="{-limit!r} {limit!r}"/>'
        )
    return mujoco.MjModel.from_xml_string(
        f"<mujoco><worldbody>{bodies}</worldbody><actuator>{actuators}</actuator>"
        "</mujoco>"
    )


def test_mujoco_computes_the_same_torque():
    print(f"seed {SEED}")
    rng = np.random.default_rng(SEED)
    gains = kp, kd, limit = _gains(build_model(load_hand_file()))
    model = _mujoco_servo(gains)
    data = mujoco.MjData(model)
    saturated = set()
    for _ in range(20):
        data.ctrl[:], data.qpos[:] = rng.uniform(-0.2, 0.2, (2, JOINTS))
        data.qvel[:] = rng.uniform(-3, 3, JOINTS)
        mujoco.mj_forward(model, data)
        state = (jnp.asarray(x) for x in (data.ctrl, data.qpos, data.qvel))
        torque = _servo_torque(*gains, *state)
        np.testing.assert_allclose(data.actuator_force, torque, atol=2e-6)
        saturated |= set((np.abs(torque) >= np.float32(limit)).tolist())
    assert saturated == {True, False}
    other = _servo_torque(kp, 1.01 * kd, limit, *_last(data))
    assert np.max(np.abs(data.actuator_force - np.asarray(other))) > 1e-4


def _last(data: mujoco.MjData) -> tuple[jax.Array, ...]:
    return tuple(jnp.asarray(x) for x in (data.ctrl, data.qpos, data.qvel))


def test_jit_and_vmap_over_randomized_drives_equal_the_single_drive():
    base = servo_drive(load_hand_file(), 12, DT)
    delays = jnp.array([0.0, 0.0123, 0.02, 0.04])
    cutoffs = jnp.array([2.0, 3.0, 4.0, 5.0])

    def run(delay_s, lowpass_hz):
        path = base.path.replace(delay_s=delay_s, lowpass_hz=lowpass_hz)
        drive = dataclasses.replace(base, path=path)
        state = drive.begin(jnp.zeros(JOINTS))
        return drive.commands(state, jnp.full(JOINTS, 0.3))[1]

    batch = jax.jit(jax.vmap(run))(delays, cutoffs)
    run_one = jax.jit(run)
    for i in range(4):
        single = run_one(delays[i], cutoffs[i])
        np.testing.assert_allclose(batch[i], single, atol=1e-6)
    assert np.max(np.abs(np.asarray(batch[0] - batch[1]))) > 1e-3


def _mean_torque(scales: dict[str, jax.Array]) -> jax.Array:
    """Mean torque over a fixed motion of a drive whose parameters are scaled."""
    path = make(0.0123 * scales["delay_s"], 3.0 * scales["lowpass_hz"])
    kp, kd = scales["kp"], 0.1 * scales["kd"]
    targets = jnp.asarray(np.random.default_rng(SEED).uniform(-1, 1, (24, JOINTS)))
    q, qd = jnp.linspace(0, 1, JOINTS), jnp.ones(JOINTS)

    def step(state, target):
        state, command = command_step(path, state, target, DT)
        joint = JointInput(command, q, qd, kp=kp, kd=kd)
        return state, jnp.mean(chain_step((), (), joint, DT)[1].torque)

    start = ServoDrive(path, 1, DT).begin(q)
    return jnp.mean(jax.lax.scan(step, start, targets)[1])


def test_gradients_are_those_of_finite_differences():
    with jax.enable_x64(True):
        mean_torque = jax.jit(_mean_torque)
        one = dict.fromkeys(("delay_s", "lowpass_hz", "kp", "kd"), jnp.asarray(1.0))
        slopes = jax.jit(jax.grad(_mean_torque))(one)
        for name in one:
            up, down = (mean_torque(one | {name: one[name] + h}) for h in (1e-6, -1e-6))
            finite = float(up - down) / 2e-6
            assert abs(finite) > 1e-5
            assert float(slopes[name]) == pytest.approx(finite, rel=1e-5)
