"""The rigid bodies of a hidden mechanism as a C MuJoCo model.

Play and compliance are two bodies: a rotor and a link on the same axis, held together
by a tendon with limits (play) or with a spring (compliance). A drive turns the rotor.
"""

import math
from dataclasses import dataclass

import mujoco
import numpy as np

from benchmarks.diagnosis.hidden.truth import Joint, Link, Mechanism

STEP_S = 0.0005
GRAVITY = 9.81
ROTOR_SHARE = 0.5
"""Share of the armature on the motor's side of play or compliance."""
STOP_RAD = 0.4
"""How far beyond their ranges joints stop: an encoder that is wrong must not lead a
recording against stops, which no effect of the catalogue describes [rad]."""


@dataclass(frozen=True)
class Plant:
    """A compiled model and where the joints stand in it.

    Attributes:
        model: the model.
        link: index of each joint's link in qpos and qvel.
        motor: index of what each drive turns, the same where nothing is between.
    """

    model: mujoco.MjModel
    link: tuple[int, ...]
    motor: tuple[int, ...]


def build(mechanism: Mechanism, step_s: float = STEP_S) -> Plant:
    """Compiles a mechanism."""
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    spec.compiler.autolimits = False
    spec.option.timestep = step_s
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.gravity = _gravity(mechanism)
    base = spec.worldbody.add_body(name="base", quat=mechanism.base_quat_w)
    bodies = {"world": base}
    extra = mechanism.payload_kg or (0.0,) * len(mechanism.links)
    last = mechanism.links[-1]
    for link, joint, mass in zip(mechanism.links, mechanism.joints, extra, strict=True):
        body = _add(spec, bodies[link.parent], link, joint, mass)
        if link is last:
            body.ipos = np.add(link.com, [mechanism.payload_shift_m, 0.0, 0.0])
        bodies[link.name] = body
    model = spec.compile()
    names = [link.name for link in mechanism.links]
    rotors = [model.joint(_motor_of(m, model)).id for m in names]
    return Plant(
        model=model,
        link=tuple(int(model.jnt_dofadr[model.joint(n).id]) for n in names),
        motor=tuple(int(model.jnt_dofadr[j]) for j in rotors),
    )


def _motor_of(name: str, model: mujoco.MjModel) -> str:
    rotor = f"{name}_rotor"
    names = {model.joint(i).name for i in range(model.njnt)}
    return rotor if rotor in names else name


def _gravity(mechanism: Mechanism) -> np.ndarray:
    """Gravity, turned about x, then y."""
    roll, pitch = mechanism.tilt_rad
    down = np.array([0.0, -math.sin(roll), math.cos(roll)])
    turned = np.array([math.sin(pitch) * down[2], down[1], math.cos(pitch) * down[2]])
    return -GRAVITY * turned


def _add(spec, parent, link: Link, joint: Joint, extra_kg: float):
    """Adds a link with its hinge, and its rotor where something is between."""
    body = parent.add_body(name=link.name, pos=link.pos, quat=link.quat)
    mass = link.mass + extra_kg
    body.mass = mass
    body.ipos = link.com
    body.iquat = link.inertia_quat
    body.inertia = np.multiply(link.inertia, mass / link.mass)
    body.explicitinertial = True
    between = {"backlash", "compliance"} & set(joint.effects)
    # What differs by direction is not MuJoCo's to model: `joint_drive` has all of it.
    viscous = "asymmetric_viscous" not in joint.effects
    dry = "asymmetric_friction" not in joint.effects
    extra = joint.value("armature", "inertia_kgm2", 0.0)
    armature = joint.armature + extra
    hinge = body.add_joint(
        name=link.name,
        type=mujoco.mjtJoint.mjJNT_HINGE,
        axis=link.axis,
        armature=armature * (1.0 - ROTOR_SHARE * bool(between)),
        damping=viscous * joint.value("viscous_friction", "damping_nms", 0.0),
        frictionloss=dry * joint.value("coulomb_friction", "torque_nm", 0.0),
        range=np.add(link.range_rad, [-STOP_RAD, STOP_RAD]),
        limited=True,
    )
    hinge.solref_friction = [4.0 * STEP_S, 1.0]
    hinge.solimp_friction = [0.999, 0.9999, 1e-4, 0.5, 2.0]  # creeps little at rest
    if between:
        _add_rotor(spec, parent, link, joint, ROTOR_SHARE * armature)
    return body


def _add_rotor(spec, parent, link: Link, joint: Joint, armature: float) -> None:
    """Adds a rotor beside the link and the tendon that holds both together."""
    name = f"{link.name}_rotor"
    body = parent.add_body(name=name, pos=link.pos, quat=link.quat, mass=1e-7)
    body.inertia = [1e-10] * 3
    body.explicitinertial = True
    body.add_joint(
        name=name,
        type=mujoco.mjtJoint.mjJNT_HINGE,
        axis=link.axis,
        armature=armature,
        limited=False,
    )
    half = 0.5 * joint.value("backlash", "gap_rad", 0.0)
    stiffness = joint.value("compliance", "stiffness_nm_rad", 0.0)
    tendon = spec.add_tendon(name=name)
    if stiffness:
        tendon.stiffness[0] = stiffness
        tendon.damping[0] = joint.value("compliance", "damping_nms_rad", 0.0)
        tendon.springlength = [0.0, 0.0]
    else:
        tendon.limited = True
        tendon.range = [-half, half]
        tendon.solref_limit = [4.0 * STEP_S, 1.0]
        tendon.solimp_limit = [0.99, 0.999, 1e-4, 0.5, 2.0]
    tendon.wrap_joint(name, 1.0)
    tendon.wrap_joint(link.name, -1.0)
