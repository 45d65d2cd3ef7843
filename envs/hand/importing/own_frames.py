"""Our frames in a hand that is built otherwise than the vendor's.

Nothing is compared with the vendor's hand. A joint's positive angles flex: the side of
the pad is where the fingertip goes when the last joint turns that way.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from envs.errors import InputError
from envs.hand.importing.palm import Frame, rotation

_CLEAR = 0.2
"""Least share of a lever that must point across a hinge to give a direction."""


@dataclass(frozen=True)
class Hinges:
    """A user's hand at zero angles, in one frame.

    Attributes:
        path: of the model, for messages.
        names: the model's names of the joints.
        anchors: places of the hinges [m].
        axes: their directions, of length 1.
        tips: middle of the outermost geom of each finger [m].
        ranges: limits of the joints [rad].
    """

    path: Path
    names: tuple[str, ...]
    anchors: Float[np.ndarray, "joints 3"]
    axes: Float[np.ndarray, "joints 3"]
    tips: Float[np.ndarray, "tips 3"]
    ranges: Float[np.ndarray, "joints 2"]

    @property
    def each(self) -> int:
        """Joints of each finger."""
        return len(self.anchors) // len(self.tips)

    def moved_into(self, frame: Frame) -> "Hinges":
        """The same in another frame, given in this one."""
        anchors, tips = ((x - frame.pos) @ frame.mat for x in (self.anchors, self.tips))
        axes = self.axes @ frame.mat
        return Hinges(self.path, self.names, anchors, axes, tips, self.ranges)

    def levers(self) -> Float[np.ndarray, "joints 3"]:
        """From each hinge to the next one of its finger, or to the tip: d [m].

        Source:
            Ours.
        """
        ends = np.concatenate([self.anchors[1:], self.tips[-1:]])
        ends[self.each - 1 :: self.each] = self.tips
        return ends - self.anchors


def own_palm_frame(hinges: Hinges, palm_quat: tuple[float, ...] | None = None) -> Frame:
    """Our palm frame in the palm body: +z along the fingers, +x the side of the pads.

    z ∝ Σ (a × d) × a, x ∝ Σ a × d − (Σ a × d · z) z, over all fingers but the thumb,
    with hinge a and lever d of their last joints: where a hinge lies along its own axis
    does not count. The origin is the body's [m].

    Args:
        hinges: in the palm body.
        palm_quat: the orientation, w x y z, where the user gives it.

    Raises:
        InputError: the pads of the fingers do not show where the palm's side is.

    Source:
        Ours.
    """
    if palm_quat is not None:
        return Frame(np.zeros(3), rotation(np.array(palm_quat)))
    last = slice(2 * hinges.each - 1, None, hinges.each)
    axes, levers = hinges.axes[last], hinges.levers()[last]
    pads = np.cross(axes, levers)
    along = _unit(np.cross(pads, axes).sum(axis=0))
    side = pads.sum(axis=0)
    across = side - (side @ along) * along
    if np.linalg.norm(across) < _CLEAR * np.linalg.norm(pads, axis=1).sum():
        found, valid = "pads that look to no common side", "a palm_quat"
        raise InputError(hinges.path, "palm_quat", found, valid)
    x = _unit(across)
    return Frame(np.zeros(3), np.stack([x, np.cross(along, x), along], axis=1))


def own_link_frames(hinges: Hinges) -> list[Frame]:
    """The links in our palm frame at zero angles: y = hinge a, x ∝ a × d.

    x is where the link's end goes when its joint flexes; where the lever d lies along
    the hinge, x is as near the palm's side of the pads, +x, as the hinge allows.

    Args:
        hinges: in our palm frame.

    Raises:
        InputError: a last joint that does not move its fingertip, or whose positive
            angles do not flex.

    Source:
        Ours.
    """
    _check_last(hinges)
    frames = []
    for anchor, axis, lever in zip(
        hinges.anchors, hinges.axes, hinges.levers(), strict=True
    ):
        x = np.cross(axis, lever)
        if np.linalg.norm(x) < _CLEAR * np.linalg.norm(lever):
            x = _across(axis)
        x = _unit(x)
        frames.append(Frame(anchor, np.stack([x, axis, np.cross(x, axis)], axis=1)))
    return frames


def _check_last(hinges: Hinges) -> None:
    """Refuses fingertips of which it is not clear where the pad is."""
    last = range(hinges.each - 1, len(hinges.names), hinges.each)
    levers = hinges.levers()
    for index in last:
        name, lever = hinges.names[index], levers[index]
        moved = np.linalg.norm(np.cross(hinges.axes[index], lever))
        if moved < max(_CLEAR * np.linalg.norm(lever), 1e-3):
            valid = f"a last joint that moves its fingertip, not {name}"
            raise InputError(hinges.path, "joint axes", name, valid)
        low, high = hinges.ranges[index]
        if high < -low:
            valid = f"positive angles that flex: {low:.2f} to {high:.2f} rad extend"
            raise InputError(hinges.path, "joint ranges", name, valid)


def _across(axis: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
    """+x of the palm, or +z for a hinge along it, made normal to the hinge."""
    for wanted in (np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])):
        x = wanted - (wanted @ axis) * axis
        if np.linalg.norm(x) > _CLEAR:
            return x
    raise AssertionError("no hinge lies along both")


def _unit(x: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
    return x / np.linalg.norm(x)
