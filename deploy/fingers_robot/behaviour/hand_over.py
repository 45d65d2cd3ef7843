"""Switching policies: the next one inherits the history that it would have had.

The last control steps are kept in physical terms: measured angles, gravity, rates,
what gamepad, keys and camera delivered, and by how much the targets were asked to move.
From these, the observation history of any policy can be built: with its own reference
angles, scales and inputs, and with the previous actions that would have asked for the
same motion,

    a = clip(atanh(Δ/α), ±c),

so that a switch from a policy to itself changes nothing at all.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingers_deploy.manifest import Interface
from fingers_deploy.observation import History, ObservationAssembler
from fingers_robot.behaviour.task_inputs import Given, inputs_of

Array = NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class Moment:
    """One control step in physical terms.

    Attributes:
        joint_pos: measured angles [rad], [20].
        gravity_b: gravity in the palm frame, [3].
        angvel_b: angular velocity in the palm frame [rad/s], [3].
        given: what the sources of commands delivered, by name of the term.
        asked_rad: asked change of the targets, α·tanh(a), [20].
    """

    joint_pos: NDArray
    gravity_b: NDArray
    angvel_b: NDArray
    given: Given
    asked_rad: NDArray


def action_for(asked_rad: NDArray, interface: Interface) -> Array:
    """The clipped policy output that asks for a change of the targets, [20]."""
    clip = interface.action.clip
    # tanh is 1 in double precision from 20 on, where atanh would be infinite.
    most = np.tanh(min(clip, 15.0))
    share = np.asarray(asked_rad, np.float64) / interface.action.scale_rad
    return np.arctanh(np.clip(share, -most, most)).astype(np.float32)


def asked_for(action: NDArray, interface: Interface) -> NDArray:
    """The change of the targets that a clipped policy output asks for [rad], [20]."""
    return interface.action.scale_rad * np.tanh(np.asarray(action, np.float64))


def build_history(
    moments: tuple[Moment, ...], interface: Interface, assembler: ObservationAssembler
) -> tuple[History | None, Array]:
    """Builds the history that a policy would have had.

    Args:
        moments: the last control steps, oldest first; at least one more than the
            longest history, if nothing of it is to be guessed. Where there are fewer,
            the oldest one stands for those before it, as at the start of an episode.
        interface: of the policy.
        assembler: of the policy.

    Returns:
        The history after the last moment (None without moments), and the action of
        that step, which is the previous action of the next one, [20].
    """
    history: History | None = None
    action = np.zeros(len(interface.joint_names), np.float32)
    for moment in moments:
        sample = assembler.sample(
            moment.joint_pos,
            moment.gravity_b,
            moment.angvel_b,
            action,
            inputs_of(interface, moment.given, moment.joint_pos),
        )
        history = assembler.update(history, sample)
        action = action_for(moment.asked_rad, interface)
    return history, action
