"""Rigs that are no hand: a vertical axis, an arm of two links, an industrial joint."""

import math

import numpy as np

from benchmarks.diagnosis.hidden.truth import Joint, Link, Mechanism

UPRIGHT = (1.0, 0.0, 0.0, 0.0)


def servo_of(
    inertia: float,
    armature: float,
    limit_nm: float,
    lowpass_hz: float,
    rng: np.random.Generator,
) -> Joint:
    """A servo of 4 to 8 Hz for what it moves.

    Args:
        inertia: of all that it turns [kg·m²].
        armature: its own part of that [kg·m²].
        limit_nm: its limit [N·m].
        lowpass_hz: cutoff of its firmware [Hz].
        rng: draws bandwidth and damping ratio.
    """
    kp = inertia * (2.0 * math.pi * rng.uniform(4.0, 8.0)) ** 2
    kd = 2.0 * rng.uniform(0.5, 0.8) * math.sqrt(kp * inertia)
    return Joint(kp, kd, armature, 0.008, lowpass_hz, 8.0, limit_nm)


def axis(rng: np.random.Generator, lowpass_hz: float):
    """A vertical axis: gravity does nothing; mechanism, middle and reach [rad]."""
    mass, arm, middle = rng.uniform(0.2, 0.5), rng.uniform(0.02, 0.05), 0.0
    armature = rng.uniform(2e-3, 5e-3)
    link = Link(
        name="axis",
        pos=(0.0, 0.0, 0.0),
        quat=UPRIGHT,
        axis=(0.0, 0.0, 1.0),
        mass=mass,
        com=(arm, 0.0, 0.0),
        inertia_quat=UPRIGHT,
        inertia=(1e-3 * mass, 1e-3 * mass, 1e-3 * mass),
        range_rad=(middle - 2.5, middle + 2.5),
    )
    inertia = armature + mass * (1e-3 + arm**2)
    joint = servo_of(inertia, armature, 100.0 * inertia, lowpass_hz, rng)
    return Mechanism((link,), (joint,)), np.array([middle]), np.array([0.9])


def arm(rng: np.random.Generator, lowpass_hz: float):
    """Shoulder and elbow under gravity; the second link carries a known payload."""
    upper, lower = rng.uniform(0.15, 0.3), rng.uniform(0.08, 0.15)
    payload, reach = rng.uniform(0.03, 0.08), rng.uniform(0.1, 0.14)
    length = 0.5 * reach
    carried = lower + payload
    com = (lower * length + payload * reach) / carried
    own = lower * reach**2 / 12.0 + lower * (com - length) ** 2
    own += payload * (reach - com) ** 2
    links = (
        _link("shoulder", (0.0, 0.0, 0.0), upper, length, upper * reach**2 / 12.0),
        _link("elbow", (0.0, 0.0, -reach), carried, com, own, "shoulder"),
    )
    armature = rng.uniform(1e-3, 3e-3, 2)
    at_elbow = armature[1] + own + carried * com**2
    at_shoulder = armature[0] + upper * (reach**2 / 12.0 + length**2)
    at_shoulder += own + carried * (reach + com) ** 2
    weight_nm = 9.81 * carried * com, 9.81 * (upper * length + carried * (reach + com))
    joints = (
        servo_of(at_shoulder, armature[0], 4.0 * weight_nm[1], lowpass_hz, rng),
        servo_of(at_elbow, armature[1], 4.0 * weight_nm[0], lowpass_hz, rng),
    )
    return Mechanism(links, joints), np.array([0.2, 0.5]), np.array([0.5, 0.5])


def cascade(rng: np.random.Generator, lowpass_hz: float):
    """A joint of an industrial arm in small: two loops and one link.

    Returns the mechanism, the moved joint, middle and reach [rad].
    """
    mass, length = rng.uniform(0.15, 0.3), rng.uniform(0.08, 0.12)
    own, armature = mass * length**2 / 3.0, rng.uniform(2e-3, 4e-3)
    inertia = armature + own + mass * length**2
    kd = inertia * rng.uniform(50.0, 90.0)
    joint = Joint(
        kp=kd * rng.uniform(8.0, 15.0),
        kd=kd,
        armature=armature,
        delay_s=0.004,
        lowpass_hz=lowpass_hz,
        limit_nm=rng.uniform(4.0, 8.0) * 9.81 * mass * length,
        k_int=kd / rng.uniform(0.03, 0.08),
        ref_rad_s=rng.uniform(1.5, 2.5),
    )
    link = _link("shoulder", (0.0, 0.0, 0.0), mass, length, own)
    return Mechanism((link,), (joint,)), (0,), np.array([0.3]), np.array([0.5])


def _link(name, pos, mass, com, own, parent="world") -> Link:
    """A link that hangs down from a horizontal axis."""
    inertia = (own, own, 0.05 * own)
    down = (0.0, 0.0, -com)
    horizontal, wide = (0.0, 1.0, 0.0), (-2.5, 2.5)
    return Link(
        name, pos, UPRIGHT, horizontal, mass, down, UPRIGHT, inertia, wide, parent
    )
