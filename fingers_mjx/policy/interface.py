"""What lies between a policy and the hand, taken from the environment it trained in."""

import dataclasses
import hashlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from envs.batch import BatchEnv
from envs.errors import InputError
from envs.hand.hand_file import HandFile
from envs.observations import HISTORY, TERMS, InputTerm
from fingers_deploy.manifest import (
    Action,
    CommandPath,
    Interface,
    Observation,
    Term,
)
from fingers_mjx.runs.directory import RUN_FILE, saved_bound

INTERFACE = "interface"
"""Name of the interface among what `identity` returns."""

TOLERANCE = 1e-6
"""Largest difference between numbers that count as the same (settling rounds)."""


def interface_of(env: BatchEnv) -> Interface:
    """Returns the interface of a policy trained in `env`."""
    stance, config = env.stance, env.config
    limits = env.spec.joint_range_rad.tolist()
    inputs = env.input_terms
    common = _common_terms(len(env.spec.joints))
    terms = tuple(_term(term) for term in (*(common[name] for name in TERMS), *inputs))
    return Interface(
        joint_names=env.spec.joints,
        reference_angles_rad=stance.joint_pos_rad,
        joint_limits_rad=tuple((low, high) for low, high in limits),
        initial_target_rad=stance.target_rad,
        control_rate_hz=1.0 / env.dt,
        observation=Observation(terms),
        action=Action(scale_rad=config.action_scale_rad, clip=config.action_clip),
        command_path=_command_path(env.hand),
        command_ranges=tuple(pair for term in inputs for pair in term.ranges),
        v_quat_b=stance.q_off,
    )


def entry_factors(
    interface: Interface, name: str, factor: ArrayLike
) -> Float[np.ndarray, " n"]:
    """Returns 1 for every entry of an observation, and `factor` for those of a term.

    Args:
        interface: of the policy.
        name: of the term, which may be missing.
        factor: of all its entries, or one of each.
    """
    factors = [
        np.broadcast_to(factor if term.name == name else 1.0, (term.history, term.size))
        for term in interface.observation.terms
    ]
    return np.concatenate([one.ravel() for one in factors])


def identity(env: BatchEnv) -> dict[str, Any]:
    """Returns what a resumed run must share besides its settings.

    The hash of the model is that of its MJCF, which holds all of hand and scene that
    physics sees; the drive's delay and filter are in the hand's own. The interface is
    also what an evaluation or export of the run must share.
    """
    spec = env.build_scene()
    spec.compile()
    return {
        "hand_sha256": env.hand.sha256,
        "model_sha256": hashlib.sha256(spec.to_xml().encode()).hexdigest(),
        INTERFACE: dataclasses.asdict(interface_of(env)),
    }


def check_run_interface(run_dir: Path, env: BatchEnv) -> None:
    """Refuses a run whose policy reads or moves something else than `env` has.

    Raises:
        InputError: naming the first field that differs.
    """
    saved = saved_bound(run_dir).get("identity", {}).get(INTERFACE, {})
    check_interface(run_dir / RUN_FILE, saved, interface_of(env))


def check_interface(
    source: object, found: Interface | Mapping[str, Any], ours: Interface
) -> None:
    """Refuses a policy whose interface is not that of the environment.

    Args:
        source: file of the policy, for the message.
        found: interface of the policy, or the fields that a run has saved of it.
        ours: interface of the environment.

    Raises:
        InputError: naming the first field that differs.
    """
    if isinstance(found, Interface):
        found = dataclasses.asdict(found)
    wanted = dict(_leaves(_one_speed(dataclasses.asdict(ours), found), "interface"))
    for field, value in _leaves(dict(found), "interface"):
        if not _same(value, wanted.get(field, "nothing")):
            valid = f"{wanted.get(field, 'nothing')}, as the environment has"
            raise InputError(source, field, value, valid)


def _common_terms(joints: int) -> Mapping[str, InputTerm]:
    """Name in the manifest, entries, frame and unit of what every task observes."""
    return {
        "joint_pos": InputTerm("joint_pos", joints, "joint", "rad"),
        "gravity": InputTerm("gravity_b", 3, "palm", "1"),
        "angvel": InputTerm("angvel_b", 3, "palm", "rad/s"),
        "action": InputTerm("previous_action", joints, "joint", "1"),
    }


def _term(term: InputTerm) -> Term:
    name, size, frame, unit = term.name, term.size, term.frame, term.unit
    return Term(name, size, frame, unit, scale=1.0, history=HISTORY)


def _command_path(hand: HandFile) -> CommandPath:
    """Returns the drive's path."""
    return CommandPath(
        delay_s=hand.delay_s.value,
        lowpass_hz=hand.lowpass_hz.value,
        slew_rad_s=tuple(hand.per_joint("speed_limit").tolist()),
    )


def _one_speed(ours: Any, found: Mapping[str, Any]) -> Any:
    """Returns ours as earlier exports stated it: one speed limit, the lowest."""
    stated = found.get("command_path", {}).get("slew_rad_s")
    if not isinstance(stated, float):
        return ours
    path = ours["command_path"]
    lowest = {**path, "slew_rad_s": min(path["slew_rad_s"])}
    return {**ours, "command_path": lowest}


def _leaves(value: Any, field: str) -> Iterator[tuple[str, Any]]:
    """Yields dotted names and values of nested dicts and lists."""
    if isinstance(value, dict):
        for name, inner in value.items():
            yield from _leaves(inner, f"{field}.{name}")
    elif isinstance(value, list | tuple):
        yield f"{field}.length", len(value)
        for index, inner in enumerate(value):
            yield from _leaves(inner, f"{field}[{index}]")
    else:
        yield field, value


def _same(found: Any, wanted: Any) -> bool:
    if isinstance(found, float) and isinstance(wanted, float):
        return abs(found - wanted) <= TOLERANCE
    return found == wanted
