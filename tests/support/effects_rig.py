"""One joint with effects, run for many substeps; shared by the tests of effects."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from envs.actuator.catalogue import CATALOGUE
from envs.actuator.chain import JointInput, chain_step, init_states
from envs.actuator.joint import joint_step
from envs.actuator.surroundings import ALONE, Gravity, Surroundings

DT = 1e-3
KP, KD, INERTIA = 2.0, 0.05, 1e-3

# A joint about y that carries 0.2 kg and a payload of 0.1 kg at (0.05, 0, 0.02) m.
AXIS, ARM = np.array([0.0, 1.0, 0.0]), np.array([0.05, 0.0, 0.02])
AROUND = Surroundings(
    others_nm=0.5,
    other_q=0.2,
    other_nm=0.1,
    inertia=INERTIA,
    gravity=Gravity(
        gravity=np.array([0.0, 0.0, -9.81]),
        moment=0.2 * np.cross(AXIS, ARM),
        payload_kg=0.1,
        payload_moment=np.cross(AXIS, ARM),
        payload_shift=np.cross(AXIS, np.eye(3)),
        payload_inertia=float(ARM @ ARM),
        payload_push=0.0,
    ),
)


def run(effects, target, load=0.0, q0=0.0, v0=0.0, kp=KP, kd=KD, dt=DT, around=AROUND):
    """Angle, speed and signals after every substep, as arrays [steps, ...].

    Args:
        effects: parameters by the effects' names, in order.
        target: targets [rad], the first one sent since ever.
        load: torque from outside [N·m], constant or one per substep.
        q0, v0: initial angle and speed.
        kp, kd: nominal gains.
        dt: substep [s].
        around: what the rest of the hand does.
    """
    target = jnp.asarray(target, jnp.float32)
    load = jnp.broadcast_to(jnp.asarray(load, jnp.float32), target.shape)
    params = tuple({k: jnp.asarray(v) for k, v in p.items()} for p in effects.values())
    out = _run(tuple(effects), params, target, load, q0, v0, kp, kd, dt, around)
    return jax.tree.map(np.asarray, out)


@partial(jax.jit, static_argnames=("names", "dt"))
def _run(names, params, target, load, q0, v0, kp, kd, dt, around):
    model = tuple((CATALOGUE[n], p) for n, p in zip(names, params, strict=True))
    q0, v0 = (jnp.broadcast_to(x, target.shape[1:]).astype(float) for x in (q0, v0))

    def step(carry, inputs):
        states, q, v = carry
        joint = JointInput(inputs[0], q, v, inputs[1], kp, kd, around)
        states, x = chain_step(model, states, joint, dt)
        q, v = joint_step(x, INERTIA, dt)
        return (states, q, v), (q, v, x.replace(around=ALONE))

    start = (init_states(model, target[0], q0, dt), q0, v0)
    return jax.lax.scan(step, start, (target, load))[1]


def steps(seconds, dt=DT):
    return round(seconds / dt)


def hold(angle, seconds, dt=DT):
    return np.full(steps(seconds, dt), float(angle))


def jump(angle, seconds, dt=DT):
    """Zero once, then an angle."""
    target = hold(angle, seconds, dt)
    target[0] = 0.0
    return target
