"""Where our palm frame lies in a user's model, and where its links stand in it.

Our palm frame has the back of the hand at -x and the fingers at +z. The vendor's hand
defines it: its finger bases and hinge axes at zero angles are what a user's model is
compared with. The frame of a link has its origin on the hinge and the hinge as +y; its
+x is as near the vendor's as the hinge allows.
"""

from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
from jaxtyping import Float

from envs.errors import InputError
from envs.hand.nominal import NominalHand, vendor_hand

BASES_RMS_M = 0.010
"""How far the finger bases may be from the vendor's."""
AXIS_COS = np.cos(np.deg2rad(45.0))
"""How far a hinge may be turned from the vendor's."""


@dataclass(frozen=True)
class Frame:
    """A frame in another one: x_other = mat x + pos [m]."""

    pos: Float[np.ndarray, "3"]
    mat: Float[np.ndarray, "3 3"]

    def of(self, inner: "Frame") -> "Frame":
        """Returns a frame given in this one, in the other one."""
        return Frame(self.pos + self.mat @ inner.pos, self.mat @ inner.mat)

    @property
    def inverse(self) -> "Frame":
        """The other frame in this one."""
        return Frame(-self.mat.T @ self.pos, self.mat.T)

    @property
    def quat(self) -> Float[np.ndarray, "4"]:
        """Orientation, w x y z."""
        quat = np.zeros(4)
        mujoco.mju_mat2Quat(quat, self.mat.ravel())
        return quat


def rotation(quat: Float[np.ndarray, "4"]) -> Float[np.ndarray, "3 3"]:
    """The matrix R(q) of a quaternion: R v = q v q* / |q|² [1].

    Args:
        quat: w x y z, of any length > 0 [1].

    Source:
        J. Diebel, Representing Attitude, Stanford University, 2006.
    """
    mat = np.zeros(9)
    mujoco.mju_quat2Mat(mat, np.asarray(quat, float) / np.linalg.norm(quat))
    return mat.reshape(3, 3)


def frames_at_zero(hand: NominalHand) -> list[Frame]:
    """Returns the links in the palm with all joints at zero."""
    frames: list[Frame] = []
    for index, link in enumerate(hand.links):
        own = Frame(np.array(link.pos), rotation(np.array(link.quat)))
        frames.append(own if index % hand.links_per_finger == 0 else frames[-1].of(own))
    return frames


def palm_frame(
    path: Path,
    anchors: Float[np.ndarray, "joints 3"],
    palm_quat: tuple[float, ...] | None = None,
) -> Frame:
    """Finds our palm frame in the palm body of a user's model.

    It is the body's own frame where the finger bases (joints 1 and 2) lie in it as the
    vendor's do, else the one in which they do so best: arg min Σ |R x_i + p − y_i|²
    over rotations R and places p [m].

    Args:
        path: of the model, for messages.
        anchors: hinge positions in the user's palm body at zero angles [m].
        palm_quat: orientation of our palm frame in that body, w x y z, where the user
            gives it; the origin is then the body's.

    Raises:
        InputError: the bases are not near the vendor's in any frame.

    Source:
        W. Kabsch, A solution for the best rotation to relate two sets of vectors, Acta
        Crystallographica A32, 1976.
    """
    if palm_quat is not None:
        return Frame(np.zeros(3), rotation(np.array(palm_quat)))
    bases = np.array([k for k in range(20) if k % 4 < 2])
    ours = np.array([frame.pos for frame in frames_at_zero(vendor_hand())])[bases]
    own = Frame(np.zeros(3), np.eye(3))
    for frame in (own, _fitted(anchors[bases], ours)):
        placed = ours @ frame.mat.T + frame.pos
        if _rms(placed - anchors[bases]) < BASES_RMS_M:
            return frame
    found = f"finger bases {1000 * _rms(placed - anchors[bases]):.0f} mm from a hand's"
    valid = (
        f"within {1000 * BASES_RMS_M:.0f} mm of the WUJI right hand's, or a palm_quat: "
        "the palm frame with the back of the hand at -x and the fingers at +z"
    )
    raise InputError(path, "palm_quat", found, valid)


def link_frames(
    path: Path,
    anchors: Float[np.ndarray, "joints 3"],
    axes: Float[np.ndarray, "joints 3"],
    names: tuple[str, ...],
) -> list[Frame]:
    """The links in our palm frame at zero angles: y = hinge, x ∝ x₀ − (x₀ · y) y.

    x₀ is the vendor's x axis of the link.

    Args:
        path: of the model, for messages.
        anchors: places of the hinges in our palm frame [m].
        axes: their directions in it, of length 1 [1].
        names: the model's names of the joints.

    Raises:
        InputError: hinges that do not turn as the vendor's do.

    Source:
        Ours; Gram–Schmidt.
    """
    vendor = [frame.mat for frame in frames_at_zero(vendor_hand())]
    turned = [
        f"{name} ({_degrees(axis, mat[:, 1]):.0f}°)"
        for name, axis, mat in zip(names, axes, vendor, strict=True)
        if axis @ mat[:, 1] < AXIS_COS
    ]
    if turned:
        valid = "hinges within 45° of the WUJI right hand's, positive angles flexing"
        raise InputError(path, "joint axes", f"turned: {', '.join(turned)}", valid)
    return [
        Frame(anchor, _with_hinge(axis, mat[:, 0]))
        for anchor, axis, mat in zip(anchors, axes, vendor, strict=True)
    ]


def _fitted(theirs: np.ndarray, ours: np.ndarray) -> Frame:
    """Rigid motion that takes our points to theirs (Kabsch 1976)."""
    mean_theirs, mean_ours = theirs.mean(0), ours.mean(0)
    u, _, vt = np.linalg.svd((theirs - mean_theirs).T @ (ours - mean_ours))
    mat = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
    return Frame(mean_theirs - mat @ mean_ours, mat)


def _with_hinge(axis: np.ndarray, x: np.ndarray) -> Float[np.ndarray, "3 3"]:
    """Axes of a link: +y the hinge, +x as near `x` as it allows."""
    x = x - (x @ axis) * axis
    x = x / np.linalg.norm(x)
    return np.stack([x, axis, np.cross(x, axis)], axis=1)


def _rms(offsets: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.sum(offsets**2, axis=1))))


def _degrees(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.degrees(np.arccos(np.clip(a @ b, -1.0, 1.0))))
