"""Properties that every kernel shares, one table of kernels times one of properties."""

import functools
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from beartype import beartype
from jax.test_util import check_grads
from jaxtyping import TypeCheckError, jaxtyped

import rewards

DT_S = 0.02
LIFT = rewards.LiftParams()
# A hand in mid-cycle whose gate is open and whose average is on the slope of S.
MID_CYCLE = (0.3, [0.008, 0.004], [True] * 5)


def lift_magnitude(tip_vel_z, tip_force_n, command_planar):
    phase, average, touched = MID_CYCLE
    memory = rewards.LiftMemory(
        jnp.asarray(phase), jnp.tile(jnp.asarray(average), (5, 1)), jnp.array(touched)
    )
    return rewards.lift_step(
        memory, tip_vel_z, tip_force_n, command_planar, DT_S, LIFT
    )[1]


def air_time_value(air_time_s, tip_force_n, command_planar):
    memory = rewards.AirTimeMemory(air_time_s)
    return rewards.air_time_step(
        memory, tip_force_n, command_planar, DT_S, rewards.AirTimeParams()
    )[1]


@dataclass(frozen=True)
class Kernel:
    """A kernel, the shapes and scales of its arguments, and its value at zero."""

    function: object
    arguments: tuple
    at_zero: float = 0.0
    signed: bool = False
    planar: tuple = ()
    tips: bool = False


VELOCITY, COMMAND, PLANAR = ((3,), 0.1), ((3,), 0.2), ((2,), 0.2)
TIPS, JOINTS, SPIN = ((5, 3), 0.05), ((20,), 1.0), ((3,), 0.3)
FORCE = ((5,), 0.3)

KERNELS = {
    "footprint_departure": Kernel(rewards.footprint_departure, (TIPS, TIPS), tips=True),
    "lift_step": Kernel(
        lift_magnitude, (((5,), 0.05), FORCE, PLANAR), planar=(2,), tips=True
    ),
    "swing_against_command": Kernel(
        rewards.swing_against_command, (TIPS, FORCE, COMMAND), planar=(0, 2), tips=True
    ),
    "track_planar_velocity": Kernel(
        rewards.track_planar_velocity, (VELOCITY, COMMAND), 1.0, planar=(0, 1)
    ),
    "track_yaw_rate": Kernel(
        rewards.track_yaw_rate, (SPIN, COMMAND), 1.0, planar=(0, 1)
    ),
    "track_mean_planar_velocity": Kernel(
        rewards.track_mean_planar_velocity, (VELOCITY,), 1.0, planar=(0,)
    ),
    "track_mean_yaw_rate": Kernel(
        rewards.track_mean_yaw_rate, (SPIN,), 1.0, planar=(0,)
    ),
    "overload": Kernel(rewards.overload, (JOINTS,)),
    "target_lag": Kernel(rewards.target_lag, (JOINTS,)),
    "vertical_velocity": Kernel(rewards.vertical_velocity, (VELOCITY,), planar=(0,)),
    "roll_pitch_rate": Kernel(rewards.roll_pitch_rate, (SPIN,), planar=(0,)),
    "torque": Kernel(rewards.torque, (JOINTS,)),
    "joint_acceleration": Kernel(rewards.joint_acceleration, (JOINTS,)),
    "action_rate": Kernel(rewards.action_rate, (JOINTS, JOINTS)),
    "undesired_contact": Kernel(rewards.undesired_contact, (((15,), 1.0),)),
    "foot_slide": Kernel(rewards.foot_slide, (TIPS, FORCE), planar=(0,), tips=True),
    "shear_excess": Kernel(rewards.shear_excess, (FORCE, FORCE), tips=True),
    "air_time_step": Kernel(
        air_time_value,
        (((5,), 0.5), FORCE, PLANAR),
        signed=True,
        planar=(2,),
        tips=True,
    ),
    "flat_orientation": Kernel(rewards.flat_orientation, (VELOCITY,), planar=(0,)),
    "palm_tilt": Kernel(rewards.palm_tilt, (VELOCITY,), 1.0, planar=(0,)),
    "stance_height": Kernel(rewards.stance_height, (((), 0.05), ((), 0.05)), 1.0),
    "level_height": Kernel(
        rewards.level_height, (((), 0.05), ((), 0.05), VELOCITY), 0.25, planar=(2,)
    ),
    "stance_pose": Kernel(rewards.stance_pose, (JOINTS, JOINTS, VELOCITY), planar=(2,)),
}


every_kernel = pytest.mark.parametrize("name", KERNELS)


@functools.cache
def compiled(name):
    return jax.jit(KERNELS[name].function)


def draw(kernel, rng, batch=()):
    """Random arguments; forces, counts and times are non-negative."""
    drawn = [rng.normal(size=batch + shape) * s for shape, s in kernel.arguments]
    unsigned = kernel.function in (rewards.undesired_contact, air_time_value)
    return tuple(
        jnp.asarray(np.abs(x) if argument is FORCE or unsigned else x, float)
        for x, argument in zip(drawn, kernel.arguments, strict=True)
    )


def zeros(kernel):
    return tuple(jnp.zeros(shape) for shape, _ in kernel.arguments)


def rotated(x, turn):
    return jnp.concatenate([x[..., :2] @ turn.T, x[..., 2:]], axis=-1)


def test_table_holds_every_kernel_of_the_library():
    tables = (rewards.STEERING, rewards.STOCK, rewards.RECOVERY)
    in_tables = {row.kernel for table in tables for row in table}
    covered = {k.function for k in KERNELS.values()} | {rewards.precomputed}
    assert in_tables <= covered
    assert set(KERNELS) <= set(rewards.__all__)


@every_kernel
def test_jit_and_vmap_equal_eager(name, rng):
    function = KERNELS[name].function
    arguments = draw(KERNELS[name], rng, (3,))
    eager = jnp.stack([function(*(a[i] for a in arguments)) for i in range(3)])
    jitted = jnp.stack([compiled(name)(*(a[i] for a in arguments)) for i in range(3)])
    mapped = jax.jit(jax.vmap(function))(*arguments)
    assert eager.shape == (3,)
    np.testing.assert_allclose(jitted, eager, rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(mapped, eager, rtol=1e-5, atol=1e-6)


@every_kernel
def test_magnitude_is_finite_and_not_negative(name, rng):
    arguments = draw(KERNELS[name], rng, (256,))
    values = np.asarray(jax.vmap(compiled(name))(*arguments))
    assert np.isfinite(values).all()
    assert KERNELS[name].signed == (values < 0.0).any()
    assert np.std(values) > 0.0


@every_kernel
def test_value_and_gradient_are_finite_at_zero(name):
    every = tuple(range(len(KERNELS[name].arguments)))
    at_zero = jax.jit(jax.value_and_grad(KERNELS[name].function, every))
    value, gradient = at_zero(*zeros(KERNELS[name]))
    assert np.isfinite(value)
    assert all(np.isfinite(g).all() for g in gradient)


@pytest.mark.parametrize("name", sorted(set(KERNELS) - {"lift_step"}))
def test_zero_point(name):
    kernel = KERNELS[name]
    assert compiled(name)(*zeros(kernel)) == kernel.at_zero


def test_lift_is_zero_from_rest():
    still = jnp.zeros(5)
    after, magnitude = rewards.lift_step(
        rewards.init_lift_memory(), still, still, jnp.zeros(2), DT_S, LIFT
    )
    assert magnitude == 0.0
    assert not after.average.any()


@every_kernel
def test_gradient_equals_finite_difference(name, rng, x64):
    arguments = draw(KERNELS[name], rng)
    assert arguments[0].dtype == jnp.float64
    check_grads(compiled(name), arguments, order=1, modes=["rev"], eps=1e-7)


@pytest.mark.parametrize("name", [n for n, k in KERNELS.items() if k.planar])
def test_rotating_the_plane_changes_nothing(name, rng, x64):
    kernel = KERNELS[name]
    angle = rng.uniform(0.0, 2.0 * np.pi)
    turn = jnp.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    arguments = draw(kernel, rng)
    turned = [
        rotated(x, turn) if i in kernel.planar else x for i, x in enumerate(arguments)
    ]
    value = compiled(name)(*arguments)
    np.testing.assert_allclose(compiled(name)(*turned), value, rtol=1e-9, atol=1e-12)


def test_footprint_feels_the_rotation(rng):
    departure = draw(KERNELS["footprint_departure"], rng)[0].at[:, 1:].set(0.0)
    turned = rotated(departure, jnp.array([[0.0, -1.0], [1.0, 0.0]]))
    fore, lateral = (
        compiled("footprint_departure")(x, jnp.zeros((5, 3)))
        for x in (departure, turned)
    )
    np.testing.assert_allclose(lateral, 4.0 * fore, rtol=1e-6)


@pytest.mark.parametrize("name", [n for n, k in KERNELS.items() if k.tips])
def test_order_of_the_fingers_does_not_matter(name, rng):
    order = rng.permutation(5)
    arguments = draw(KERNELS[name], rng)
    permuted = [x[order] if x.shape[0] == 5 else x for x in arguments]
    value = compiled(name)(*arguments)
    np.testing.assert_allclose(compiled(name)(*permuted), value, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("name", sorted(set(KERNELS) - {"air_time_step"}))
def test_nan_is_not_hidden(name, rng):
    first, *rest = draw(KERNELS[name], rng)
    if KERNELS[name].tips and name != "footprint_departure":
        rest[0] = jnp.array([0.0, 0.0, 0.0, 1.0, 1.0])  # some tips up, some down
        rest[1:] = [jnp.full_like(command, 0.1) for command in rest[1:]]
    assert np.isnan(compiled(name)(first * jnp.nan, *rest))


def lift_call(tip_vel_z, tip_force_n, command_planar):
    memory = rewards.init_lift_memory()
    return memory, tip_vel_z, tip_force_n, command_planar, DT_S, LIFT


def air_time_call(air_time_s, tip_force_n, command_planar):
    memory, params = rewards.AirTimeMemory(air_time_s), rewards.AirTimeParams()
    return memory, tip_force_n, command_planar, DT_S, params


@every_kernel
def test_shape_annotations_are_executed(name, rng):
    checked = jaxtyped(getattr(rewards, name), typechecker=beartype)
    call = {"lift_step": lift_call, "air_time_step": air_time_call}.get(name)
    arguments = draw(KERNELS[name], rng)
    arguments = call(*arguments) if call else arguments
    checked(*arguments)
    for i, argument in enumerate(arguments):
        if isinstance(argument, jax.Array):
            wrong = (*arguments[:i], argument[None], *arguments[i + 1 :])
            with pytest.raises(TypeCheckError):
                checked(*wrong)


@pytest.mark.parametrize(
    ("function", "arguments"),
    [
        (rewards.safe_norm, (jnp.ones((4, 3)),)),
        (rewards.smoothstep, (0.0, 1.0, jnp.ones((4, 3)))),
        (rewards.tracking_kernel, (jnp.ones(2), 0.5)),
        (rewards.in_contact, (jnp.ones(5), 0.15)),
        (rewards.is_commanded, (jnp.ones(2), 0.02)),
        (rewards.lift_frequency_hz, (jnp.asarray(0.1), LIFT)),
        (rewards.lift_gate, (jnp.ones(5), jnp.ones(5, bool), jnp.ones(2), LIFT)),
        (rewards.init_lift_memory, ()),
        (rewards.footprint_step, (rewards.init_footprint_memory(), jnp.ones((5, 3)))),
        (rewards.precomputed, (jnp.asarray(1.0),)),
        (rewards.table_weights, (rewards.CRAWL, {"footprint": -1.0})),
        (rewards.weights_at, (rewards.table_weights(rewards.CRAWL), jnp.asarray(3))),
    ],
)
def test_annotations_of_the_helpers_hold(function, arguments):
    jaxtyped(function, typechecker=beartype)(*arguments)
