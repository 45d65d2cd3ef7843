"""What a policy reads beside the hand's own state, term by term of its manifest."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fingers_deploy.manifest import Interface, Term
from fingers_deploy.observation import COMMON_TERMS
from fingers_robot.behaviour.keyboard.fingertip import pressing_fingertip

Array = NDArray[np.float32]
Given = Mapping[str, NDArray]
"""What the sources delivered in one control step, by name of the term."""

FINGERTIP = "fingertip_pos"
OBJECT_TERMS = ("object_pos", "object_vel", "object_to_target")
"""Terms that a camera delivers, as `tracking.ObjectTracker.inputs` orders them."""


def input_terms(interface: Interface) -> tuple[Term, ...]:
    """The terms of an interface that are inputs of its task, in their order."""
    terms = interface.observation.terms
    return tuple(term for term in terms if term.name not in COMMON_TERMS)


def reads(interface: Interface, names: tuple[str, ...]) -> bool:
    """Whether a policy reads any of these terms."""
    return any(term.name in names for term in input_terms(interface))


def inputs_of(interface: Interface, given: Given, joint_pos: ArrayLike) -> Array:
    """The task inputs of one control step, term after term, [n].

    The pressing fingertip follows from the joints. What no source delivered, as before
    the first sample of a camera or while another task ran, is zero: no command, no
    request.

    Args:
        interface: of the policy.
        given: what the sources delivered.
        joint_pos: measured joint angles [rad], [20].
    """
    parts = [
        pressing_fingertip(joint_pos, interface.v_quat_b)
        if term.name == FINGERTIP
        else resized(given.get(term.name, np.zeros(0)), term.size)
        for term in input_terms(interface)
    ]
    return np.concatenate([np.zeros(0), *parts]).astype(np.float32)


def resized(values: NDArray, size: int) -> Array:
    """A command of another task: the common entries, zeros behind them."""
    kept = np.zeros(size, np.float32)
    kept[: min(size, len(values))] = values[:size]
    return kept
