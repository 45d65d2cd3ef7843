"""What supervisor and policy exchange once in a control step."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingers_robot.reading import Array
from fingers_robot.safety.detectors.policy import complement
from fingers_robot.safety.types import PolicyFault, Proposal

COMMANDS = 9  # most task inputs of any task


@dataclass(frozen=True, slots=True)
class Query:
    """What the supervisor asks the policy with.

    Attributes:
        tick: number of the control step.
        t_s: monotonic time [s].
        joint_pos: measured joint angles [rad], [20]; NaN where unknown, as below.
        quat_w: orientation of the palm, w x y z, [4].
        gyro_b: angular velocity of the palm in the palm frame [rad/s], [3].
        target_rad: targets on the wire [rad], [20].
        runs: the policy's targets pass; else it starts afresh at `target_rad`.
        policy: number of the policy that the operator has selected.
        key: one more than the place of a key that the operator asks for now; 0: none.
        turned_rad: sum of the turns that the operator has asked for [rad], so that one
            is not lost with a query.
        challenge: number whose complement renews the lease.
    """

    tick: int
    t_s: float
    joint_pos: Array
    quat_w: Array
    gyro_b: Array
    target_rad: Array
    runs: bool
    policy: int = 0
    key: int = 0
    turned_rad: float = 0.0
    challenge: int = 0


@dataclass(frozen=True, slots=True)
class Answer:
    """A proposal, with what the log keeps of it.

    Attributes:
        proposal: for the supervisor.
        command: task inputs that the policy saw, filled up with NaN, [9].
        policy: number of the policy that made it.
    """

    proposal: Proposal
    command: NDArray[np.float32]
    policy: int


def propose(
    query: Query,
    target_rad: NDArray,
    age_s: float = 0.0,
    fault: PolicyFault = PolicyFault.NONE,
) -> Proposal:
    """Returns the proposal that answers a query.

    Args:
        query: gives number and challenge.
        target_rad: proposed joint targets [rad], [20].
        age_s: age of what the policy's inputs depend on [s].
        fault: what is wrong with this step.
    """
    response, target = complement(query.challenge), np.asarray(target_rad, np.float64)
    return Proposal(query.tick, response, target, age_s, fault)


def padded(inputs: NDArray[np.float32]) -> NDArray[np.float32]:
    """Task inputs [n] filled up with NaN, [9]."""
    command = np.full(COMMANDS, np.nan, np.float32)
    command[: len(inputs)] = inputs
    return command
