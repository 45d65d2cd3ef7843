"""Test stands: mechanisms as they are believed to be, before anything is hidden.

`pendulum` is a servo with a weight, `axis`, `arm` and `cascade` are those of `rigs`;
`joint` is one joint of a finger of the hand, `finger` all four of one, `hand` all
twenty on one palm. The last three take the vendor's kinematics and its drive.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from benchmarks.diagnosis.hidden import rigs
from benchmarks.diagnosis.hidden.truth import Joint, Link, Mechanism
from envs.hand.hand_file import load_hand_file
from envs.hand.nominal import vendor_hand

KINDS = ("pendulum", "axis", "arm", "cascade", "joint", "finger", "hand")
TOLERANCES = {
    "kp": 0.05,
    "kd": 0.1,
    "armature": 0.05,
    "mass": 0.05,
    "delay_s": 0.05,
    "lowpass_hz": 0.05,
    "slew_rad_s": 0.05,
    "offset_rad": 1e-3,
}
"""How wrong nominal parameters may be: relative, the encoder's zero in radian."""


@dataclass(frozen=True)
class Stand:
    """A believed mechanism and how it is recorded.

    Attributes:
        kind: one of `KINDS`.
        mechanism: what is believed.
        moved: joints that are recorded, by index.
        middle, reach: angles about which and how far they move [rad].
        tolerances: how wrong nominal parameters may be.
        gains_free: whether nothing is known of the gains.
    """

    kind: str
    mechanism: Mechanism
    moved: tuple[int, ...]
    middle: np.ndarray
    reach: np.ndarray
    tolerances: Mapping[str, float] = field(default_factory=lambda: TOLERANCES)
    gains_free: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the joints."""
        return tuple(link.name for link in self.mechanism.links)


def make_stand(kind: str, rng: np.random.Generator, lowpass_hz: float = 3.0) -> Stand:
    """Draws a stand of a kind."""
    if kind == "pendulum":
        return _pendulum(rng, lowpass_hz)
    if kind == "hand":
        return _hand(rng, lowpass_hz)
    if kind in ("axis", "arm"):
        mechanism, middle, reach = getattr(rigs, kind)(rng, lowpass_hz)
        return Stand(kind, mechanism, tuple(range(len(reach))), middle, reach)
    if kind == "cascade":
        known = {**TOLERANCES, "kd": 0.05, "k_int": 0.05}
        return Stand(kind, *rigs.cascade(rng, lowpass_hz), tolerances=known)
    finger = int(rng.integers(1, 5))
    mechanism, middle, reach = _finger(finger, rng, lowpass_hz)
    if kind == "finger":
        return Stand(kind, mechanism, (0, 1, 2, 3), middle, reach)
    joint = int(rng.integers(0, 4))
    reach = np.where(np.arange(4) == joint, reach, 0.0)
    return Stand(kind, mechanism, (joint,), middle, reach)


def _pendulum(rng: np.random.Generator, lowpass_hz: float) -> Stand:
    mass, length = rng.uniform(0.1, 0.25), rng.uniform(0.06, 0.12)
    middle = rng.uniform(-0.6, 0.6)
    link = Link(
        name="servo",
        pos=(0.0, 0.0, 0.0),
        quat=(1.0, 0.0, 0.0, 0.0),
        axis=(0.0, 1.0, 0.0),
        mass=mass,
        com=(0.0, 0.0, -length),
        inertia_quat=(1.0, 0.0, 0.0, 0.0),
        inertia=(4e-4 * mass, 4e-4 * mass, 4e-4 * mass),
        range_rad=(middle - 2.0, middle + 2.0),
    )
    armature = rng.uniform(1e-3, 3e-3)
    inertia = armature + mass * length**2
    kp = inertia * (2.0 * math.pi * rng.uniform(6.0, 9.0)) ** 2
    kd = 2.0 * rng.uniform(0.5, 0.8) * math.sqrt(kp * inertia)
    joint = Joint(kp, kd, armature, 0.019, lowpass_hz, 8.0, 4.0 * mass)
    mechanism = Mechanism((link,), (joint,))
    return Stand("pendulum", mechanism, (0,), np.array([middle]), np.array([0.5]))


def _finger(finger: int, rng: np.random.Generator, lowpass_hz: float):
    """A finger of the hand (1 to 4; the thumb is left out) on a palm that is turned."""
    hand, names = load_hand_file(), vendor_hand().joint_names
    links, joints, middle, reach = [], [], [], []
    for i in range(4 * finger, 4 * finger + 4):
        link = vendor_hand().links[i]
        parent = "world" if i == 4 * finger else names[i - 1]
        links.append(
            Link(
                name=link.joint,
                pos=link.pos,
                quat=link.quat,
                axis=(0.0, 1.0, 0.0),
                mass=link.mass,
                com=link.inertial_pos,
                inertia_quat=link.inertial_quat,
                inertia=link.diaginertia,
                range_rad=link.range_rad,
                parent=parent,
            )
        )
        joints.append(
            Joint(
                kp=link.kp * hand.per_joint("stiffness_scale")[i],
                kd=link.kv * hand.per_joint("damping_scale")[i],
                armature=link.armature,
                delay_s=hand.delay_s.value,
                lowpass_hz=lowpass_hz,
                slew_rad_s=float(hand.per_joint("speed_limit")[i]),
                limit_nm=link.force_limit * hand.per_joint("torque_scale")[i],
            )
        )
        low, high = link.range_rad
        middle.append(0.5 * (low + high))
        reach.append(min(0.5, 0.4 * (high - low)))
    quat = rng.normal(size=4)
    quat /= np.linalg.norm(quat)
    mechanism = Mechanism(tuple(links), tuple(joints), tuple(quat.tolist()))
    return mechanism, np.array(middle), np.array(reach)


def _hand(rng: np.random.Generator, lowpass_hz: float) -> Stand:
    fingers = [_finger(finger, rng, lowpass_hz) for finger in range(5)]
    mechanisms = [mechanism for mechanism, _, _ in fingers]
    links = tuple(link for m in mechanisms for link in m.links)
    joints = tuple(joint for m in mechanisms for joint in m.joints)
    whole = Mechanism(links, joints, mechanisms[0].base_quat_w)
    middle = np.concatenate([angles for _, angles, _ in fingers])
    reach = np.concatenate([angles for _, _, angles in fingers])
    return Stand("hand", whole, tuple(range(20)), middle, reach)


def changed(mechanism: Mechanism, joint: int, name: str, by: float) -> Mechanism:
    """Returns a mechanism with one parameter of a joint off by a share.

    The encoder's zero is off by an angle instead.
    """
    if name == "mass":
        masses = list(mechanism.payload_kg or (0.0,) * len(mechanism.links))
        masses[joint] += by * mechanism.links[joint].mass
        return replace(mechanism, payload_kg=tuple(masses))
    old = mechanism.joints[joint]
    value = getattr(old, name)
    new = value + by if name == "offset_rad" else value * (1.0 + by)
    return mechanism.with_joint(joint, replace(old, **{name: new}))


def slightly_wrong(
    mechanism: Mechanism,
    rng: np.random.Generator,
    tolerances: Mapping[str, float] = TOLERANCES,
) -> Mechanism:
    """Returns what a mechanism may be while it is believed to be this one."""
    for joint in range(len(mechanism.joints)):
        for name, tolerance in tolerances.items():
            by = tolerance * rng.uniform(-1.0, 1.0)
            mechanism = changed(mechanism, joint, name, by)
    return mechanism
