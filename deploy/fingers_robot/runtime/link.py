"""The link between supervisor and policy: one packet each way per control step."""

import select
import socket

import numpy as np

from fingers_robot.behaviour.exchange import COMMANDS, Answer, Query
from fingers_robot.reading import JOINT_COUNT
from fingers_robot.safety.types import PolicyFault, Proposal
from fingers_robot.waiting import EVERY, waiting

_AT_ONCE = 16  # answers that one step of the loop takes

QUERY = np.dtype(
    [
        ("challenge", "<u8"),
        ("tick", "<i8"),
        ("t_s", "<f8"),
        ("joint_pos", "<f8", (JOINT_COUNT,)),
        ("quat_w", "<f8", (4,)),
        ("gyro_b", "<f8", (3,)),
        ("target_rad", "<f8", (JOINT_COUNT,)),
        ("runs", "?"),
        ("policy", "<i4"),
        ("key", "<i4"),
        ("turned_rad", "<f8"),
    ]
)
"""Supervisor to policy: the fields of `Query`."""
_FIELDS = QUERY.names or ()

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


def make_link() -> tuple[socket.socket, socket.socket]:
    """Returns the supervisor's and the policy's end."""
    return socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)


class _End:
    """One end of the link; sending never blocks.

    Args:
        end: the socket.
    """

    def __init__(self, end: socket.socket):
        self._socket = end
        end.setblocking(False)
        self.open = True

    def _put(self, data: bytes) -> None:
        """Sends a packet; one for which there is no room is lost."""
        try:
            self._socket.send(data)
        except BlockingIOError:
            return
        except OSError:
            self.open = False


class SupervisorEnd(_End):
    """The supervisor's end; never blocks."""

    def send(self, query: Query) -> None:
        """Sends a query; one that the policy has no room for is lost."""
        self._put(encode_query(query))

    def poll(self) -> Answer | None:
        """Returns the newest answer since the last call.

        A policy that floods the link is read bit by bit: it may not hold up the loop.
        """
        newest, there = _newest(self._socket, ANSWER.itemsize, _AT_ONCE)
        self.open = self.open and there
        return decode_answer(newest) if newest else None


class PolicyEnd(_End):
    """The policy's end."""

    def wait(self, seconds: float) -> Query | None:
        """Returns the newest query once one has come; None after some time [s]."""
        select.select([self._socket], [], [], seconds)
        newest, self.open = _newest(self._socket, QUERY.itemsize, EVERY)
        return decode_query(newest) if newest else None

    def send(self, answer: Answer) -> None:
        """Sends an answer; a supervisor that does not read will miss its lease."""
        self._put(encode_answer(answer))


def _newest(end: socket.socket, size: int, most: int) -> tuple[bytes, bool]:
    """Newest of at most `most` waiting packets, and whether the other end is there."""
    newest = b""
    for data in waiting(end.recv, size, most):
        if len(data) != size:
            # Nothing means that the other end is closed; half a packet is none.
            return newest, len(data) > 0
        newest = data
    return newest, True


def encode_query(query: Query) -> bytes:
    """Packs a query."""
    return np.array(tuple(getattr(query, name) for name in _FIELDS), QUERY).tobytes()


def decode_query(data: bytes) -> Query:
    """Unpacks a query."""
    values = np.frombuffer(data, QUERY)[0].item()
    return Query(**dict(zip(_FIELDS, values, strict=True)))


def encode_answer(answer: Answer) -> bytes:
    """Packs an answer."""
    proposal, packet = answer.proposal, np.zeros((), ANSWER)
    packet["response"], packet["tick"] = proposal.response, proposal.tick
    count = len(proposal.target_rad)
    packet["target"][:count] = proposal.target_rad
    packet["joints"], packet["fault"] = count, proposal.fault
    packet["command"], packet["policy"] = answer.command, answer.policy
    packet["command_age_s"] = proposal.command_age_s
    return packet.tobytes()


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
