"""Where residuals rest on readings, and a simulation on targets that are known."""

import numpy as np
from jaxtyping import Bool, Shaped

from sysid.diagnosis.measured.segments import FINER, SLOW_S, Piece
from sysid.drive import JointDrive

SETTLE_S = 0.4
"""Time in which a joint follows a target that is not in the record [s]."""

REST = 0.05
"""Share of a joint's large speeds below which it is at rest."""

SETTLED = 4.6
"""Time constants of a low-pass after which a hundredth of a step is left, ln 100."""


def supported(piece: Piece, j: int, steps: int) -> Bool[np.ndarray, " t"]:
    """Where residuals rest on readings: v_t = ∧_{|k| ≤ 8} valid_{t+k}, settled.

    Args:
        piece: one stretch of a record.
        j: number of the joint.
        steps: length of the grid, at least that of the piece [steps].

    Returns:
        Whether the steps count; none of the first `SETTLE_S`, before which the target
        is not known, nor of those in which rows are too far apart for the motion.

    Source:
        Ours: the band of the residuals reaches 8 steps.
    """
    valid = np.zeros(steps, bool)
    valid[: len(piece.t_s)] = piece.valid[:, j]
    settle = int(SETTLE_S / (piece.t_s[1] - piece.t_s[0])) + 8
    bad = ~valid
    bad[:settle] = True  # the past of the target is not known
    spread = np.convolve(bad, np.ones(17), "same") > 0
    return ~spread & _resolved(piece, j, steps)


def _resolved(piece: Piece, j: int, steps: int) -> np.ndarray:
    """Marks where the rows are close enough together for the motion.

    Of a motion that lasts a few rows only the rests before and after it count: the
    joint is at rest and its target has not changed for `SETTLE_S`.
    """
    resolved = np.ones(steps, bool)
    if piece.row_s > SLOW_S:
        settle = int(SETTLE_S / (piece.t_s[1] - piece.t_s[0]))
        changed = np.diff(piece.cmd[:, j], prepend=piece.cmd[0, j]) != 0.0
        speed = np.abs(piece.vel[:, j])
        moves = speed > REST * np.percentile(speed, 98)
        busy = np.convolve(changed, np.ones(2 * settle + 1), "same")
        busy += np.convolve(moves, np.ones(2 * FINER + 1), "same")
        resolved[: len(busy)] = busy == 0
    return resolved


def begins_anew(
    drive: JointDrive, resumed: Shaped[np.ndarray, "t p"], dt: float
) -> Bool[np.ndarray, "t p"]:
    """Where a simulation begins anew: until its command is that of the drive.

    A command that still lacks a lost target pushes the joint elsewhere, and a servo at
    its limit does not bring it back for seconds.

        T + 4.6 / 2π f_c  behind the targets that are known again

    Args:
        drive: with the nominal delay T [s] and low-pass f_c [Hz].
        resumed: 1 where targets are known again, else 0.
        dt: step of the grid [s].

    Returns:
        Whether it begins anew, there and until then.

    Source:
        Ours.
    """
    late = drive.parameter("transport_delay", "delay_s", 0.0)
    slow = 2.0 * np.pi * drive.parameter("lowpass_cutoff", "cutoff_hz", np.inf)
    rows = int(np.ceil((late + SETTLED / slow) / dt))
    last = np.cumsum(resumed, 0)
    before = np.pad(last, [(rows + 1, 0), (0, 0)])[: len(last)]
    return last > before
