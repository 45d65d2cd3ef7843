"""The link between supervisor and policy: one packet each way per control step."""

import socket
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingers_deploy.manifest import JOINT_COUNT
from fingers_robot.safety.types import PolicyFault, Proposal

Array = NDArray[np.float64]
COMMANDS = 9  # most task inputs of any task
_AT_ONCE = 16  # answers that one step of the loop takes

OBSERVATION = np.dtype(
    [
        ("challenge", "<u8"),
        ("tick", "<i8"),
        ("t_s", "<f8"),
        ("pos", "<f8", (JOINT_COUNT,)),
        ("quat", "<f8", (4,)),
        ("gyro", "<f8", (3,)),
        ("target", "<f8", (JOINT_COUNT,)),
        ("runs", "<i4"),
        ("policy", "<i4"),
        ("key", "<i4"),
    ]
)
"""Supervisor to policy: measurements, targets on the wire, whether the policy runs, and
which policy the operator has selected; `key` is one more than the place of a key that
the operator asks for now, 0 for none."""

ANSWER = np.dtype(
    [
        ("response", "<u8"),
        ("tick", "<i8"),
        ("target", "<f8", (JOINT_COUNT,)),
        ("command", "<f4", (COMMANDS,)),
        ("command_age_s", "<f4"),
        ("joints", "<i4"),
        ("fault", "<i4"),
        ("policy", "<i4"),
    ]
)
"""Policy to supervisor: the answer to one observation; `joints` says how many targets
there are."""


@dataclass(frozen=True, slots=True)
class Answer:
    """A proposal, with what the log tells about it.

    Attributes:
        proposal: for the supervisor.
        command: task inputs that the policy saw, filled up with NaN, [9].
        policy: number of the policy that made it.
    """

    proposal: Proposal
    command: NDArray[np.float32]
    policy: int


def make_link() -> tuple[socket.socket, socket.socket]:
    """Returns the supervisor's and the policy's end."""
    return socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)


class SupervisorEnd:
    """The supervisor's end; never blocks.

    Args:
        end: the socket.
    """

    def __init__(self, end: socket.socket):
        self._socket = end
        end.setblocking(False)
        self.open = True

    def send(self, observation: np.ndarray) -> None:
        """Sends an observation; one that the policy has no room for is lost."""
        try:
            self._socket.send(observation.tobytes())
        except BlockingIOError:
            return
        except OSError:
            self.open = False

    def poll(self) -> Answer | None:
        """Returns the newest answer since the last call.

        A policy that floods the link is read bit by bit: it may not hold up the loop.
        """
        newest = None
        for _ in range(_AT_ONCE):
            try:
                data = self._socket.recv(ANSWER.itemsize)
            except BlockingIOError:
                break
            except OSError:
                data = b""
            if len(data) != ANSWER.itemsize:
                # Nothing means that the other end is closed; half an answer is none.
                self.open = self.open and len(data) > 0
                break
            newest = data
        return None if newest is None else decode_answer(newest)


def decode_answer(data: bytes) -> Answer:
    """Unpacks an answer; everything in it is still to be judged."""
    packet = np.frombuffer(data, ANSWER)[0]
    fault, joints = int(packet["fault"]), int(packet["joints"])
    known = fault in PolicyFault.__members__.values()
    # A number of joints that no packet can hold stands for none.
    count = joints if 0 <= joints <= JOINT_COUNT else 0
    proposal = Proposal(
        tick=int(packet["tick"]),
        response=int(packet["response"]),
        target_rad=packet["target"][:count],
        command_age_s=float(packet["command_age_s"]),
        fault=PolicyFault(fault) if known else PolicyFault.OUTPUT,
    )
    return Answer(proposal, packet["command"], int(packet["policy"]))


def encode_answer(
    proposal: Proposal, command: NDArray[np.float32], policy: int
) -> bytes:
    """Packs an answer; `command` [n] may be shorter than nine."""
    packet = np.zeros((), ANSWER)
    packet["response"], packet["tick"] = proposal.response, proposal.tick
    count = len(proposal.target_rad)
    packet["target"][:count] = proposal.target_rad
    packet["joints"], packet["fault"] = count, proposal.fault
    packet["command"] = np.nan
    packet["command"][: len(command)] = command
    packet["command_age_s"], packet["policy"] = proposal.command_age_s, policy
    return packet.tobytes()
