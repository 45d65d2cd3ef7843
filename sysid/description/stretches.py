"""One joint in all records: its motion, the torque that takes, and what it was sent."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy.signal import lfilter

from sysid.diagnosis.measured.resampling import SMOOTH_STEPS, smoothed
from sysid.diagnosis.measured.segments import Piece
from sysid.diagnosis.replay.band import BAND_STEPS
from sysid.diagnosis.replay.validity import supported
from sysid.logs.log import MeasuredLog
from sysid.rigid import Bodies

AT_ONCE_S = 1e-6
"""A target that was sent with a reading does not act on it yet [s]."""


@dataclass(frozen=True, eq=False)
class Stretch:
    """One joint in one piece of a record, behind the band of the residuals.

    Attributes:
        settings: of the controller in this record.
        dt: step [s].
        t_s: times [s].
        sent_s, target: when targets were sent [s], and which [rad].
        pos, vel: angle [rad] and speed [rad/s].
        need_nm: torque that the motion takes by the masses of the MJCF file,
            I q̈ − m · g − push of other joints [N·m].
        effort: of the drive in the unit of its column; NaN if not logged.
        valid: where readings support all that.
    """

    settings: dict[str, float]
    dt: float
    t_s: Float[np.ndarray, " n"]
    sent_s: Float[np.ndarray, " s"]
    target: Float[np.ndarray, " s"]
    pos: Float[np.ndarray, " n"]
    vel: Float[np.ndarray, " n"]
    need_nm: Float[np.ndarray, " n"]
    effort: Float[np.ndarray, " n"]
    valid: Bool[np.ndarray, " n"]

    def command(self, delay_s: float, cutoff_hz: float) -> Float[np.ndarray, " n"]:
        """c(t) = path(t − T): the target that is held, behind a low-pass.

        Args:
            delay_s: T [s].
            cutoff_hz: of a low-pass of first order; infinite: none [Hz].

        Returns:
            The target that the servo follows, behind the band of the angles [rad].

        Source:
            `sysid.diagnosis.replay.command`, on the grid alone.
        """
        last = np.searchsorted(self.sent_s, self.t_s - delay_s - AT_ONCE_S, "right") - 1
        held = self.target[np.maximum(last, 0)]
        if np.isfinite(cutoff_hz):
            left = np.exp(-2.0 * np.pi * cutoff_hz * self.dt)
            held = lfilter([1.0 - left], [1.0, -left], held, zi=[left * held[0]])[0]
        return _banded(smoothed(held, SMOOTH_STEPS))


def stretches_of(
    logs: Sequence[MeasuredLog],
    pieces: Sequence[Piece],
    bodies: Sequence[Bodies],
    j: int,
) -> list[Stretch]:
    """Returns the pieces of one joint.

    Args:
        logs: the records.
        pieces: their pieces, all joints.
        bodies: what rigid-body dynamics says along each.
        j: number of the joint.
    """
    return [_stretch(logs[p.log], p, b, j) for p, b in zip(pieces, bodies, strict=True)]


def _stretch(log: MeasuredLog, piece: Piece, body: Bodies, j: int) -> Stretch:
    sent_s, target = log.samples(f"cmd.{log.header.joints[j]}")
    order = np.argsort(sent_s, kind="stable")
    need = body.inertia[:, j] * piece.acc[:, j] - body.weight[:, j] - body.push[:, j]
    effort = piece.effort[:, j]
    return Stretch(
        settings=log.header.settings,
        dt=float(piece.t_s[1] - piece.t_s[0]),
        t_s=piece.t_s,
        sent_s=sent_s[order],
        target=target[order],
        pos=_banded(piece.pos[:, j]),
        vel=_banded(piece.vel[:, j]),
        need_nm=_banded(need),
        effort=effort if np.any(np.isnan(effort)) else _banded(effort),
        valid=supported(piece, j, len(piece.t_s)),
    )


def _banded(x: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    return smoothed(x, BAND_STEPS)
