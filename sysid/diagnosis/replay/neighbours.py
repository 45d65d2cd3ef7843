"""Joints that may pull on another one, as far as records can show it."""

from collections.abc import Sequence

import numpy as np

from sysid.diagnosis.measured.segments import Piece
from sysid.mechanism import Mechanism


def pulling(
    mechanism: Mechanism, joints: tuple[str, ...], j: int, pieces: Sequence[Piece]
) -> list[int]:
    """Returns the neighbours of joint j that are driven; j itself if none is.

    One that holds still has a constant angle, and its effort answers to the weight and
    the acceleration of joint j: all that it does, joint j does.

    Args:
        mechanism: the nominal simulation.
        joints: names of the joints in the records.
        j: the joint that is pulled.
        pieces: of the records, with their targets.
    """
    near = _beside(mechanism, joints, j)
    return [k for k in near if _is_driven(mechanism, joints, k, pieces)] or [j]


def _beside(mechanism: Mechanism, joints: tuple[str, ...], j: int) -> list[int]:
    """Returns the joints on the parent's body and on its children."""
    model = mechanism.model
    body = [int(model.jnt_bodyid[model.joint(n).id]) for n in joints]
    parents = [int(model.body_parentid[b]) for b in body]
    before = [k for k, other in enumerate(body) if other == parents[j]]
    behind = [k for k, parent in enumerate(parents) if parent == body[j]]
    return before + behind


def _is_driven(
    mechanism: Mechanism, joints: tuple[str, ...], k: int, pieces: Sequence[Piece]
) -> bool:
    """Whether a joint has targets that change, or none that count."""
    if mechanism.drives[joints[k]].known != "both":
        return True
    return any(np.ptp(p.held[:, :, k]) > 0.0 for p in pieces)
