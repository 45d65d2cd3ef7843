"""A hand from a user's own MJCF instead of ours, checked and with its names resolved.

The file may be hostile or broken: its text and files are checked first
(`custom_files`), then it is compiled in a child process with limits (`custom_child`),
and only then here. What our environments need and the model lacks is named in one
sentence; what can be filled in is filled in and listed.
"""

import difflib
import json
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from envs.errors import InputError
from envs.hand.importing.files import TIMESTEP_S, check_files
from envs.hand.importing.joint_map import JointMap
from envs.hand.nominal import FINGERS
from envs.physics.quiet_mujoco import mujoco

_CHILD = Path(__file__).with_name("child.py")


@dataclass(frozen=True)
class CustomHand:
    """A user's hand; every tuple is in our order, finger by finger.

    Attributes:
        path: the MJCF, links followed.
        spec: the model, not attached to anything; elements used below have names.
        joints: names of the hinges.
        names: our names of links and joints.
        actuators: name of the actuator of each joint; empty if the model has none.
        palm: body that carries the fingers.
        root_joint: free joint of the hand, "" if it is fixed to the world.
        tip_bodies: distal body of each finger.
        tip_geoms: colliding geom of each distal body farthest from its joint.
        defaults: sentences that say what was filled in.
    """

    path: Path
    spec: mujoco.MjSpec
    joints: tuple[str, ...]
    names: tuple[tuple[str, str], ...]
    actuators: tuple[str, ...]
    palm: str
    root_joint: str
    tip_bodies: tuple[str, ...]
    tip_geoms: tuple[str, ...]
    defaults: tuple[str, ...]


def load_custom_hand(
    path: str | Path,
    joint_map: JointMap | None = None,
    cpu_limit_s: int = 4,
) -> CustomHand:
    """Loads a user's MJCF.

    Args:
        path: main MJCF file; everything it names must lie in its folder.
        joint_map: the model's names of our joints, where they differ.
        cpu_limit_s: processor seconds the trial compilation may take; large meshes may
            need more.

    Returns:
        The hand with all names resolved in our order.

    Raises:
        InputError: unsafe or malformed file, or a model that is not this hand; the
            sentence lists everything that is missing.
    """
    joint_map = joint_map or JointMap()
    names = joint_map.names
    file = check_files(path)
    _compile_in_child(file, cpu_limit_s)
    spec = mujoco.MjSpec.from_file(str(file))
    _name_everything(spec)
    model = spec.compile()
    low, high = TIMESTEP_S
    if not low <= model.opt.timestep <= high:
        raise InputError(path, "timestep", model.opt.timestep, f"{low:g} to {high:g} s")
    return _resolve(file, spec, model, names, joint_map.own_names)


def _compile_in_child(path: Path, cpu_limit_s: int) -> None:
    """Compiles in a process with limits; raises if it fails, hangs or crashes."""
    command = [sys.executable, "-I", str(_CHILD), str(path), str(cpu_limit_s)]
    valid = f"an MJCF that compiles within {cpu_limit_s} s of processor time and 3 GiB"
    try:
        with tempfile.TemporaryDirectory() as folder:  # MuJoCo drops its log there
            done = subprocess.run(
                command,
                cwd=folder,
                capture_output=True,
                timeout=10 * cpu_limit_s,
                check=False,
            )
        fault = json.loads(done.stdout.decode("utf-8", "replace") or "{}").get("error")
    except (subprocess.TimeoutExpired, ValueError) as error:
        raise InputError(path, "", type(error).__name__, valid) from error
    if fault is None:
        raise InputError(path, "", f"the compiler died ({done.returncode})", valid)
    if fault:
        raise InputError(path, "", fault, "a sound MJCF")


def _name_everything(spec: mujoco.MjSpec) -> None:
    """Gives unnamed bodies, geoms and joints names, so that they can be referred to."""
    groups = (
        ("body", spec.bodies),
        ("geom", spec.geoms),
        ("joint", spec.joints),
        ("actuator", spec.actuators),
    )
    for kind, items in groups:
        taken = {item.name for item in items}
        for number, item in enumerate(items):
            if not item.name:
                name = f"unnamed_{kind}_{number}"
                item.name = name if name not in taken else f"{name}_"


def _resolve(
    path: Path,
    spec: mujoco.MjSpec,
    model: mujoco.MjModel,
    names: tuple[str, ...],
    own_names: tuple[tuple[str, str], ...],
) -> CustomHand:
    """Finds joints, actuators, palm and tips, or says all that is missing."""
    missing = [*_missing_joints(model, names), *_extra_joints(model, names)]
    if missing:
        raise _not_this_hand(path, model, missing)
    joints = [model.joint(name).id for name in names]
    each = sum(body.startswith("finger1_") for body, _ in own_names)
    bodies = model.jnt_bodyid[joints].reshape(-1, each).tolist()
    palm = _common_parent(
        model, [int(model.body_parentid[chain[0]]) for chain in bodies]
    )
    tip_bodies = [chain[-1] for chain in bodies]
    tips = [_tip_geom(model, body) for body in tip_bodies]
    actuators, unmoved = _actuators(model, joints)
    if palm == 0:
        missing.append(f"a palm body that carries the {len(bodies)} fingers")
    missing += [
        f"a colliding geom on the tip body {model.body(body).name}"
        for body, tip in zip(tip_bodies, tips, strict=True)
        if tip < 0
    ]
    missing += _broken_chains(model, bodies)
    if unmoved and len(unmoved) < len(names):
        missing.append("one actuator each on " + ", ".join(unmoved))
    if missing:
        raise _not_this_hand(path, model, missing)
    actuators = () if unmoved else actuators
    root = _root_joint(model, palm)
    return CustomHand(
        path=path,
        spec=spec,
        joints=names,
        names=own_names,
        actuators=actuators,
        palm=model.body(palm).name,
        root_joint=root,
        tip_bodies=tuple(model.body(body).name for body in tip_bodies),
        tip_geoms=tuple(model.geom(tip).name for tip in tips),
        defaults=_defaults(actuators, root),
    )


def _not_this_hand(
    path: Path, model: mujoco.MjModel, missing: Iterable[str]
) -> InputError:
    found = f"a model with {model.njnt} joints and {model.nu} actuators"
    return InputError(path, "", found, "a model that also has " + "; ".join(missing))


def _missing_joints(model: mujoco.MjModel, names: Iterable[str]) -> list[str]:
    """Sentences on joints that are absent, no hinges or without limits."""
    there = {model.joint(i).name: i for i in range(model.njnt)}
    absent = [_with_near(name, there) for name in names if name not in there]
    hinge = mujoco.mjtJoint.mjJNT_HINGE
    found = [(name, there[name]) for name in names if name in there]
    slides = [name for name, i in found if model.jnt_type[i] != hinge]
    free = [
        name
        for name, i in found
        if not model.jnt_limited[i] or np.ptp(model.jnt_range[i]) <= 0
    ]
    groups = (("joints", absent), ("hinges as", slides), ("limits of", free))
    return [f"{what} {', '.join(which)}" for what, which in groups if which]


def _with_near(name: str, names: Iterable[str]) -> str:
    near = difflib.get_close_matches(name, list(names), n=1)
    return f"{name} (near: {near[0]})" if near else name


def _extra_joints(model: mujoco.MjModel, names: Iterable[str]) -> list[str]:
    """A sentence on joints that are neither ours nor the free root."""
    free, known = mujoco.mjtJoint.mjJNT_FREE, set(names)
    listed = [model.joint(i) for i in range(model.njnt)]
    extra = [j.name for j in listed if j.type[0] != free and j.name not in known]
    return [
        f"no joints but the {len(known)} of the hand, not {', '.join(extra)}"
    ] * bool(extra)


def _common_parent(model: mujoco.MjModel, bodies: Iterable[int]) -> int:
    """Returns the deepest body above all `bodies`; 0, the world, if there is none."""
    chains = [_ancestors(model, body) for body in bodies]
    shared = set(chains[0]).intersection(*chains[1:])
    return next(body for body in chains[0] if body in shared)


def _ancestors(model: mujoco.MjModel, body: int) -> list[int]:
    """Returns `body` and the bodies above it, nearest first, ending with the world."""
    chain = [int(body)]
    while chain[-1]:
        chain.append(int(model.body_parentid[chain[-1]]))
    return chain


def _broken_chains(model: mujoco.MjModel, bodies: list[list[int]]) -> list[str]:
    """Sentences on fingers whose joints do not follow each other."""
    return [
        f"the joints of the {finger} one behind the other"
        for finger, chain in zip(FINGERS, bodies, strict=False)
        if any(
            upper == lower or upper not in _ancestors(model, lower)
            for upper, lower in pairwise(chain)
        )
    ]


def _tip_geom(model: mujoco.MjModel, body: int) -> int:
    """Returns the colliding geom that reaches farthest from the joint, or -1."""
    geoms = range(
        model.body_geomadr[body], model.body_geomadr[body] + model.body_geomnum[body]
    )
    solid = [g for g in geoms if model.geom_contype[g] or model.geom_conaffinity[g]]
    return max(
        solid,
        key=lambda g: float(np.linalg.norm(model.geom_pos[g]) + model.geom_rbound[g]),
        default=-1,
    )


def _actuators(
    model: mujoco.MjModel, joints: list[int]
) -> tuple[tuple[str, ...], list[str]]:
    """Returns the actuator of each joint and the joints without exactly one."""
    on_joint = model.actuator_trntype == mujoco.mjtTrn.mjTRN_JOINT
    owners = [
        np.flatnonzero(on_joint & (model.actuator_trnid[:, 0] == joint))
        for joint in joints
    ]
    unmoved = [
        model.joint(joint).name
        for joint, owner in zip(joints, owners, strict=True)
        if len(owner) != 1
    ]
    return tuple(model.actuator(o[0]).name for o in owners if len(o)), unmoved


def _root_joint(model: mujoco.MjModel, palm: int) -> str:
    """Returns the free joint that carries the palm, "" if it is fixed."""
    for joint in range(model.njnt):
        free = model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_FREE
        if free and model.jnt_bodyid[joint] in _ancestors(model, palm):
            return model.joint(joint).name
    return ""


def _defaults(actuators: tuple[str, ...], root: str) -> tuple[str, ...]:
    """Says what the model does not bring and the environment will add."""
    sentences = []
    if not actuators:
        sentences.append("no actuators: the drive takes the vendor's parameters")
    if not root:
        sentences.append("the palm is fixed: it gets a free joint")
    return tuple(sentences)
