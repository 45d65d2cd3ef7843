"""Equation errors of candidates along one track; none is evaluated twice.

Fits that go on from where others ended ask for the same again, as of the simulated
angle (`memory`).
"""

from dataclasses import dataclass, field
from functools import partial

import numpy as np
from jaxtyping import Float, Int

from sysid.diagnosis.fits.lanes import FEW_LANES, in_lanes
from sysid.diagnosis.fits.memory import Memory, remembered
from sysid.diagnosis.fits.parameters import Space
from sysid.diagnosis.fits.paths import Values, command_paths
from sysid.diagnosis.replay import link
from sysid.diagnosis.replay.acting import are_acting
from sysid.diagnosis.replay.beside import LATE
from sysid.diagnosis.replay.motion import JointTrack
from sysid.diagnosis.replay.residuals import equation_error
from sysid.diagnosis.replay.target_path import WITHIN
from sysid.diagnosis.side_by_side import side_by_side

_LATE = tuple(effect for effect, _ in LATE)

LEFT_OUT = ((*_LATE, *link.EFFECTS), _LATE, ())
"""Effects without which an evaluation takes 0.5, 0.7 and 1 of the time."""


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
    track = data.track

    def errors(new: np.ndarray) -> np.ndarray:
        params, _ = space.values(thetas[new])
        paths, which = command_paths(track, params, data.dt, evaluated.paths)
        kinds = _kinds(params, len(new))
        order = np.argsort(-kinds, kind="stable")

        def batch(lanes: np.ndarray, count: int) -> np.ndarray:
            some = paths[which[lanes]], thetas[new[lanes]], kinds[lanes].max()
            found = np.asarray(equation_error(*_arguments(data, space, *some)))
            # Within the program that would take twice the time of all else.
            return np.ascontiguousarray(np.moveaxis(found, -1, 0)[:count])

        batches = in_lanes(order, FEW_LANES)
        calls = [partial(batch, *lanes) for lanes in batches]
        return np.concatenate(side_by_side(calls))[np.argsort(order)]

    return remembered(evaluated.along(data), thetas, errors)


def compile_equations(data: JointTrack, space: Space, kind: int) -> None:
    """Compiles a program, so that `equation_errors` finds it when it first needs it.

    Args:
        data: the joint's track.
        space: coordinates.
        kind: index of what it leaves out in `LEFT_OUT`.
    """
    thetas = np.repeat(space.nominal[None], FEW_LANES, 0)
    shape = FEW_LANES, 2 + len(WITHIN), *data.track.cmd.shape
    paths = np.zeros(shape, np.float32)
    equation_error.lower(*_arguments(data, space, paths, thetas, kind)).compile()


def _arguments(
    data: JointTrack,
    space: Space,
    paths: Float[np.ndarray, "c k t p"],
    thetas: Float[np.ndarray, "c n"],
    kind: int,
) -> tuple:
    """Returns what `equation_error` takes for candidates."""
    names = tuple(e for e in space.effects if e not in LEFT_OUT[kind])
    values, speed = space.values(thetas), np.float32(data.friction_speed)
    return (data.track, paths, values, speed, data.dt, names)


def _kinds(params: Values, count: int) -> Int[np.ndarray, " c"]:
    """Returns the first of `LEFT_OUT` with which a candidate may be evaluated.

    Batches are as many as without kinds: each is evaluated as its slowest candidate.
    """
    late, linked = (are_acting(params, x, count) for x in (LATE, link.SIZES))
    return np.where(late, len(LEFT_OUT) - 1, linked.astype(int))
