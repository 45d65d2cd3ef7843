"""Putting the observation together, from the manifest alone."""

from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fingers_deploy.manifest import Interface

Sample: TypeAlias = tuple[NDArray[np.float32], ...]
History: TypeAlias = tuple[NDArray[np.float32], ...]


COMMON_TERMS = ("joint_pos", "gravity_b", "angvel_b", "previous_action")
"""Terms of every task; all others are its inputs."""


def input_size(interface: Interface) -> int:
    """Number of task inputs of one control step, the sum over their terms."""
    terms = interface.observation.terms
    return sum(term.size for term in terms if term.name not in COMMON_TERMS)


class ObservationAssembler:
    """Turns one sample per control step into the observation vector.

    The vector is, term by term in the order of the manifest, the last `history` samples
    from oldest to newest. The history is a value: the caller keeps it, and passes None
    for the first sample of an episode, which then stands for all samples before it.

    Args:
        interface: the interface part of a manifest.
    """

    def __init__(self, interface: Interface):
        self._terms = interface.observation.terms
        inputs = [term for term in self._terms if term.name not in COMMON_TERMS]
        self._input_names = [term.name for term in inputs]
        self._input_ends = np.cumsum([term.size for term in inputs])
        self._reference = np.asarray(interface.reference_angles_rad, np.float32)

    def sample(
        self,
        joint_pos: ArrayLike,
        gravity_b: ArrayLike,
        angvel_b: ArrayLike,
        previous_action: ArrayLike,
        command: ArrayLike,
    ) -> Sample:
        """Returns the scaled terms of one control step, in the manifest's order.

        o_i = scale_i · x_i; of the joint angles the reference is subtracted before.

        Args:
            joint_pos: measured joint angles [rad], in the manifest's joint order, [n].
            gravity_b: unit vector of gravity (points down) in the palm frame, [3].
            angvel_b: angular velocity of the palm in the palm frame [rad/s], [3].
            previous_action: clipped policy output of the step before [1], [n].
            command: all task inputs one after another as the manifest's terms
                describe them, e.g. v_x, v_y [m/s] and yaw rate [rad/s] in V, [3].

        Raises:
            ValueError: an argument of another shape.

        Source:
            Ours: the observation of training (`docs/reference/crawl.md`).
        """
        values = {
            "joint_pos": np.asarray(joint_pos, np.float32),
            "gravity_b": np.asarray(gravity_b, np.float32),
            "angvel_b": np.asarray(angvel_b, np.float32),
            "previous_action": np.asarray(previous_action, np.float32),
            **self._split(np.asarray(command, np.float32)),
        }
        for term in self._terms:
            shape = values[term.name].shape
            if shape != (term.size,):
                raise ValueError(
                    f"{term.name}: found shape {shape}; valid: {term.size}"
                )
        values["joint_pos"] = values["joint_pos"] - self._reference
        return tuple(values[t.name] * np.float32(t.scale) for t in self._terms)

    def _split(self, inputs: NDArray[np.float32]) -> dict[str, NDArray[np.float32]]:
        """Returns each term's part of the task inputs."""
        size = self._input_ends[-1] if self._input_names else 0
        if inputs.shape != (size,):
            named = " + ".join(self._input_names) or "command"
            raise ValueError(f"{named}: found shape {inputs.shape}; valid: ({size},)")
        parts = np.split(inputs, self._input_ends[:-1])
        return dict(zip(self._input_names, parts, strict=False))

    def update(self, history: History | None, sample: Sample) -> History:
        """Returns the history with `sample` as its newest entry, [history, size] each.

        Args:
            history: the history so far; None at the start of an episode.
            sample: the terms of this control step.
        """
        if history is None:
            return tuple(
                np.tile(value, (term.history, 1))
                for term, value in zip(self._terms, sample, strict=True)
            )
        return tuple(
            np.concatenate([kept[1:], value[None]])
            for kept, value in zip(history, sample, strict=True)
        )

    def flatten(self, history: History) -> NDArray[np.float32]:
        """Returns the observation vector o = (H₁, H₂, …) [N], scaled, without unit [1].

        Args:
            history: each term's samples H_i, oldest first, [history, size] each.

        Source:
            Ours: the order of training (`docs/reference/crawl.md`).
        """
        return np.concatenate([kept.ravel() for kept in history])
