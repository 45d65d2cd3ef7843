"""Equation errors of candidates along one track; none is evaluated twice.

Fits that go on from where others ended ask for the same again, as of the simulated
angle (`memory`).
"""

from dataclasses import dataclass, field
from functools import partial

import numpy as np
from jaxtyping import Float

from sysid.diagnosis.fits.lanes import FEW_LANES, in_lanes, lanes_first
from sysid.diagnosis.fits.memory import Memory, remembered
from sysid.diagnosis.fits.parameters import Space
from sysid.diagnosis.fits.paths import command_paths
from sysid.diagnosis.replay.motion import JointTrack
from sysid.diagnosis.replay.residuals import equation_error
from sysid.diagnosis.side_by_side import side_by_side


@dataclass(eq=False)
class Evaluated:
    """What has been evaluated of one joint.

    Attributes:
        paths: of targets, by the parameters of the path.
        errors: of candidates along the track, both residuals.
        data: the track with its noise; along another one all errors are others. The
            targets and the meaning of coordinates are the joint's, and stay.
    """

    paths: Memory = field(default_factory=dict)
    errors: Memory = field(default_factory=dict)
    data: JointTrack | None = None

    def along(self, data: JointTrack) -> Memory:
        """Returns the errors along a track, and forgets those along another."""
        if self.data is not data:
            self.data, self.errors = data, {}
        return self.errors

    def forget(self) -> None:
        """Forgets all: the joints of a hand would fill the memory."""
        self.paths, self.errors, self.data = {}, {}, None


def equation_errors(
    data: JointTrack,
    space: Space,
    thetas: Float[np.ndarray, "c n"],
    evaluated: Evaluated,
) -> Float[np.ndarray, "c 2 m p"]:
    """Residuals e(θ) of candidates; see `replay.residuals.equation_error`.

    Args:
        data: the joint's track.
        space: coordinates.
        thetas: coordinates of candidates [1].
        evaluated: of the same joint; it grows.

    Returns:
        Controller and mechanics [N·m], in single precision.

    Source:
        Ours.
    """
    track, speed = data.track, np.float32(data.friction_speed)

    def errors(new: np.ndarray) -> np.ndarray:
        params, _ = space.values(thetas[new])
        paths, which = command_paths(track, params, data.dt, evaluated.paths)

        def batch(lanes: np.ndarray, count: int) -> np.ndarray:
            values, fixed = space.values(thetas[new[lanes]]), (speed, data.dt)
            taken = track, paths[which[lanes]], values
            return lanes_first(equation_error(*taken, *fixed, space.effects), count)

        batches = in_lanes(np.arange(len(new)), FEW_LANES)
        return np.concatenate(
            side_by_side([partial(batch, *lanes) for lanes in batches])
        )

    return remembered(evaluated.along(data), thetas, errors)
