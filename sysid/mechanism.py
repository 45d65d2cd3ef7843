"""What was measured: joints with rigid-body model, drive and tolerances.

A mechanism is the simulation as it stands: rigid bodies in MuJoCo, and for every joint
the gains of its servo and the effects (of `envs.actuator.effects`) that the simulation
already has. Each nominal parameter has a tolerance within which it is as expected.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from envs.config.typed import load_yaml
from envs.errors import InputError, one_of
from envs.hand.hand_file import HandFile, load_hand_file
from envs.hand.importing.files import check_files
from envs.hand.model import build_spec
from envs.hand.nominal import NominalHand
from envs.hand.places import places
from envs.physics.quiet_mujoco import mujoco
from sysid.drive import DriveFile, JointDrive, Nominal
from sysid.mjcf.passive import with_passive


@dataclass(frozen=True, eq=False)
class Mechanism:
    """Rigid bodies and drives.

    Attributes:
        model: MuJoCo model whose actuators are not used; a free root is welded.
        drives: by joint name.
        classes: joints by class name (`flexion`, `abduction`, a finger, …).
        hand: the hand file, if the mechanism is the hand.
    """

    model: Any
    drives: Mapping[str, JointDrive]
    classes: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    hand: HandFile | None = None

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints in the order of the model."""
        return tuple(self.drives)

    def is_slide(self, joint: str) -> bool:
        """Whether a joint moves along a line."""
        return self.model.joint(joint).type[0] == int(mujoco.mjtJoint.mjJNT_SLIDE)


def mjcf_mechanism(mjcf: str | Path, drive: str | Path) -> Mechanism:
    """Makes the mechanism of a user: an MJCF file and `drive.yaml`.

    Raises:
        InputError: a file that cannot be read, a joint that is in one of them only.
    """
    return model_mechanism(load_mjcf(mjcf), load_yaml(DriveFile, drive).joints, mjcf)


def load_mjcf(mjcf: str | Path) -> Any:
    """Compiles an MJCF file of a user.

    Raises:
        InputError: a file that cannot be read, or that MuJoCo does not compile.
    """
    try:
        return mujoco.MjModel.from_xml_path(str(check_files(mjcf)))
    except (ValueError, OSError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(mjcf, "", error, "an MJCF file") from error


def model_mechanism(
    model: Any, drives: Mapping[str, JointDrive], source: object = "mechanism"
) -> Mechanism:
    """Makes a mechanism of a compiled model and drives by joint name or `*`.

    A joint without a name, as of a free root, stands where it is.

    Raises:
        InputError: a drive of a joint that is not in the model, or no joint at all; or
            something that is not simulated, see `sysid.mjcf`.
    """
    movable = _movable(model, source)
    for name in drives:
        if name != "*" and name not in movable:
            raise InputError(source, "joints", name, one_of(movable, name))
    chosen = {n: drives.get(n, drives.get("*")) for n in movable}
    kept = {
        name: with_passive(model, name, drive, source)
        for name, drive in chosen.items()
        if drive is not None
    }
    if not kept:
        raise InputError(source, "joints", ", ".join(drives), "a drive for a joint")
    return Mechanism(model, kept)


def _movable(model: Any, source: object) -> list[str]:
    """Names of its hinges and slides; no log can name one that has none."""
    simple = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))
    # By number: MuJoCo does not find joints without a name by their name.
    joints = [model.joint(i) for i in range(model.njnt)]
    names = [j.name for j in joints if j.name and j.type[0] in simple]
    if not names:
        found = f"{model.njnt} joints, none of them a hinge or slide with a name"
        raise InputError(source, "joints", found, "a hinge or slide with a name")
    return names


def hand_mechanism(hand: HandFile | None = None) -> Mechanism:
    """Makes the mechanism of the hand on a stand: the palm does not move.

    The command path of the hand file (delay, low-pass, speed limit) and its torque
    limit are effects that the simulation has.

    Examples:
        >>> mechanism = hand_mechanism()
        >>> len(mechanism.joints), mechanism.joints[0]
        (20, 'finger1_joint1')
        >>> joint_range(mechanism, "finger1_joint1")
        (0.0475, 1.6033)
    """
    hand = hand or load_hand_file()
    spec = build_spec(hand)
    for joint in spec.joints:
        if joint.type == mujoco.mjtJoint.mjJNT_FREE:
            spec.delete(joint)
    model = spec.compile()
    drives = {
        link.joint: _hand_drive(hand, index)
        for index, link in enumerate(hand.nominal.links)
    }
    return Mechanism(model, drives, _hand_classes(hand.nominal), hand)


def joint_range(mechanism: Mechanism, joint: str) -> tuple[float, float]:
    """Returns the range of a joint [rad]; ±π where the model has none."""
    found = mechanism.model.joint(joint)
    if not mechanism.model.jnt_limited[found.id]:
        return -np.pi, np.pi
    low, high = mechanism.model.jnt_range[found.id]
    return float(low), float(high)


def rest_posture(mechanism: Mechanism) -> Float[np.ndarray, " j"]:
    """q_j = clip(0, low_j, high_j): where joints stand that do not move [rad].

    Source:
        Ours: at 0, or at the end of the range that is nearest to it.
    """
    ranges = [joint_range(mechanism, joint) for joint in mechanism.joints]
    return np.array([np.clip(0.0, low, high) for low, high in ranges])


def joint_groups(mechanism: Mechanism, names: Sequence[str]) -> list[tuple[str, ...]]:
    """Returns joints one by one, and classes (a finger, `pip`, …) as groups.

    Raises:
        InputError: a name that is neither.
    """
    groups: list[tuple[str, ...]] = []
    for name in names or mechanism.joints:
        if name in mechanism.classes:
            groups.append(tuple(mechanism.classes[name]))
        elif name in mechanism.joints:
            groups.append((name,))
        else:
            valid = one_of([*mechanism.joints, *mechanism.classes], name)
            raise InputError("plan", "joints", name, valid)
    return groups


def joint_address(
    mechanism: Mechanism,
) -> tuple[Int[np.ndarray, " j"], Int[np.ndarray, " j"]]:
    """a, d with q_j = qpos[a_j] and q̇_j = qvel[d_j], indices of the joints [1].

    Source:
        MuJoCo documentation, `mjModel.jnt_qposadr` and `jnt_dofadr`.
    """
    model = mechanism.model
    ids = [model.joint(joint).id for joint in mechanism.joints]
    return model.jnt_qposadr[ids], model.jnt_dofadr[ids]


def check_two_gains(mechanism: Mechanism, action: str) -> None:
    """Refuses a cascade where every drive is simulated as a servo with two gains.

    Args:
        mechanism: the simulation as it stands.
        action: what is done, for the message.

    Raises:
        InputError: a joint whose drive has a velocity loop.
    """
    for joint, drive in mechanism.drives.items():
        if drive.cascade is not None:
            valid = f"kp and kd: {action} simulates servos with two gains alone"
            raise InputError("drive", f"{joint}.cascade", "a velocity loop", valid)


def _hand_drive(hand: HandFile, index: int) -> JointDrive:
    """Drive of one joint of the hand."""
    link = hand.nominal.links[index]
    limit = link.force_limit * hand.per_joint("torque_scale")[index]
    return JointDrive(
        kp=Nominal(link.kp * hand.per_joint("stiffness_scale")[index]),
        kd=Nominal(link.kv * hand.per_joint("damping_scale")[index], 0.1),
        effects={
            "transport_delay": {"delay_s": Nominal(hand.delay_s.value)},
            "lowpass_cutoff": {"cutoff_hz": Nominal(hand.lowpass_hz.value)},
            "slew_limit": {
                "speed_rad_s": Nominal(float(hand.per_joint("speed_limit")[index]))
            },
            "torque_limit": {"limit_nm": Nominal(float(limit))},
        },
    )


def _hand_classes(hand: NominalHand) -> dict[str, tuple[str, ...]]:
    """Joints of the hand by kind and by finger."""
    known = places(hand)
    kinds = ("flexion", "abduction", "pip", "dip", *hand.fingers)
    return {name: known[name] for name in kinds}
