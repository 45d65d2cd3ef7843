"""One substep of a position-controlled joint with any tuple of effects."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from envs.actuator.effect import EffectKind, Params, Stage, Substep
from envs.actuator.surroundings import ALONE, Surroundings
from envs.errors import InputError

Model = Sequence[tuple[EffectKind, Params]]
"""Effects with their parameters; those of one stage act in this order."""


@dataclass(frozen=True)
class JointInput:
    """What a joint starts a substep from; without gains only the command path counts.

    Attributes:
        target: target of this substep [rad].
        q, qd: joint angle [rad] and speed [rad/s].
        load: torque of everything but the drive on the joint [N·m].
        kp, kd: nominal gains of the servo [N·m/rad], [N·m·s/rad].
        around: what the rest of the hand does, for effects that need it.
    """

    target: Float[Array, "*#j"]
    q: Float[Array, "*j"]
    qd: Float[Array, "*j"]
    load: Float[ArrayLike, "*#j"] = 0.0
    kp: Float[ArrayLike, "*#j"] = 1.0
    kd: Float[ArrayLike, "*#j"] = 0.0
    around: Surroundings = ALONE


def init_states(
    model: Model, target: Float[Array, "*#j"], q: Float[Array, "*j"], dt: float
) -> tuple[Any, ...]:
    """States of all effects at rest, in which no signal changes: ẋ = 0.

    Args:
        model: effects with their parameters.
        target: target that has been sent since t = −∞ [rad].
        q: angle at which the joint rests [rad].
        dt: substep [s], > 0.

    Source:
        Ours: an episode and a record start at rest, so that no filter is filled by
        a transient.
    """
    return tuple(kind.init(params, target, q, dt) for kind, params in model)


def chain_step(
    model: Model,
    states: tuple[Any, ...],
    joint: JointInput,
    dt: float,
) -> tuple[tuple[Any, ...], Substep]:
    """Runs one substep: target → command → servo → transmission → friction → reading.

        e = c − y,   τ = kp e − kd ẏ

    with command c [rad] and encoder y [rad]; effects change the signals where they
    act. Without effects this is the plain servo.

    Args:
        model: effects with their parameters.
        states: their states after the previous substep.
        joint: target, motion, load and gains.
        dt: substep [s], > 0.

    Returns:
        The new states, and the signals: torques, friction, damping and inertia go to
        the physics (see `joint_step`), effort and reading to the observer.

    Raises:
        InputError: an effect needs surroundings that are not given.

    Source:
        Paper, command path and actuators; each effect names its own.
    """
    _check_surroundings(model, joint.around)
    x = _signals(joint)
    for stage in Stage:
        x = _servo(stage, x)
        states, x = _act(model, states, stage, x, dt)
    return states, x


def _signals(joint: JointInput) -> Substep:
    """The signals before any stage; what a stage computes is zero until then."""
    shape = jnp.shape(joint.q)
    given = (joint.kp, joint.kd, joint.load)
    kp, kd, load = (jnp.broadcast_to(x, shape) for x in given)
    none = jnp.zeros_like(joint.q)
    free = jnp.full_like(none, jnp.inf)
    return Substep(
        command=joint.target,
        goal=joint.target,
        rising=free,
        falling=free,
        q=joint.q,
        qd=joint.qd,
        encoder=joint.q,
        encoder_speed=joint.qd,
        error=none,
        kp=kp,
        kd=kd,
        effort=none,
        follows=jnp.ones_like(none),
        torque=none,
        damping=none,
        passive=none,
        load=load,
        friction=none,
        viscous=none,
        inertia=none,
        reading=none,
        around=joint.around,
    )


def _servo(stage: Stage, x: Substep) -> Substep:
    """What happens without effects just before those of a stage act."""
    if stage is Stage.PROFILE:
        return x.replace(goal=x.command)
    if stage is Stage.ERROR:
        return x.replace(error=x.command - x.encoder)
    if stage is Stage.TORQUE:
        return x.replace(torque=x.kp * x.error - x.kd * x.encoder_speed)
    if stage is Stage.TRANSMISSION:
        return x.replace(effort=x.torque, damping=x.follows * x.kd)
    if stage is Stage.READING:
        return x.replace(reading=x.encoder)
    return x


def _act(
    model: Model, states: tuple[Any, ...], stage: Stage, x: Substep, dt: float
) -> tuple[tuple[Any, ...], Substep]:
    """Lets the effects of one stage act in order."""
    after = []
    for (kind, params), state in zip(model, states, strict=True):
        if (act := kind.acts.get(stage)) is not None:
            state, x = act(params, state, x, dt)
        after.append(state)
    return tuple(after), x


def _check_surroundings(model: Model, around: Surroundings) -> None:
    for kind, _ in model:
        for name in kind.needs:
            if getattr(around, name) is None:
                valid = "an effect whose surroundings are given"
                raise InputError("effect", f"{kind.name}.{name}", "nothing", valid)
