"""From policy output to joint targets."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fingers_deploy.manifest import Interface

Array = NDArray[np.float32]


class ActionTransform:
    """a_t = clip(a, ±c); target ← clip(target + α·tanh(a_t), joint limits).

    Arithmetic is float32, as in training. The limits are rounded inward, so that a
    target is within the limits of the manifest in double precision as well.

    Args:
        interface: the interface part of a manifest.
    """

    def __init__(self, interface: Interface):
        limits = np.asarray(interface.joint_limits_rad, np.float64)
        self.low = _round(limits[:, 0], np.float32(np.inf))
        self.high = _round(limits[:, 1], np.float32(-np.inf))
        self._alpha = np.float32(interface.action.scale_rad)
        self._clip = np.float32(interface.action.clip)

    def clip_action(self, action: ArrayLike) -> Array:
        """Returns a_t = min(max(a, −c), c), within ±c; NaN stays NaN.

        Args:
            action: policy output [1], [n].

        Source:
            Ours: the bound of training (`docs/reference/crawl.md`, Action).
        """
        return np.clip(np.asarray(action, np.float32), -self._clip, self._clip)

    def clip_target(self, target_rad: ArrayLike) -> Array:
        """Returns min(max(target, low), high), within the limits; NaN stays NaN.

        Args:
            target_rad: joint targets [rad], [n].

        Source:
            Ours: the limits of training (`docs/reference/crawl.md`, Action).
        """
        return np.clip(np.asarray(target_rad, np.float32), self.low, self.high)

    def step(self, target_rad: ArrayLike, action: ArrayLike) -> Array:
        """Returns clip(target + α·tanh(clip(a, ±c))): finite, within the limits.

        Args:
            target_rad: the target so far [rad], [n].
            action: policy output a [1], clipped or not, [n].

        Returns:
            The next target [rad], [n].

        Raises:
            ValueError: another shape, or a NaN or an infinity in an argument; what to
                do then is for the caller to decide (`PolicyController` holds).

        Source:
            Ours: the action of training (`docs/reference/crawl.md`, Action).
        """
        target = np.asarray(target_rad, np.float32)
        action = np.asarray(action, np.float32)
        if target.shape != self.low.shape or action.shape != self.low.shape:
            found = f"{target.shape} and {action.shape}"
            raise ValueError(
                f"target and action: found {found}; valid: {self.low.shape}"
            )
        if not (np.all(np.isfinite(target)) and np.all(np.isfinite(action))):
            raise ValueError("target and action: found NaN or infinity; valid: finite")
        change = self._alpha * np.tanh(self.clip_action(action))
        # The targets are clipped first: adding to the largest float32 could overflow.
        return self.clip_target(self.clip_target(target) + change)


def _round(limit: NDArray[np.float64], inward: np.float32) -> Array:
    """Rounds to float32, never outward."""
    rounded = limit.astype(np.float32)
    outside = rounded < limit if inward > 0 else rounded > limit
    return np.where(outside, np.nextafter(rounded, inward), rounded)
