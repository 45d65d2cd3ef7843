"""An orientation for a hand of which only the direction of gravity is known."""

import numpy as np
from jaxtyping import Float


def orientation_of(gravity_b: Float[np.ndarray, "3"]) -> Float[np.ndarray, "4"]:
    """Returns the shortest rotation, w x y z, under which gravity has that direction.

    q = (1 + c, g × d) normalized, with d = (0, 0, −1) and c = g · d. Its heading means
    nothing. Upside down, where the shortest rotation is not unique, it is half a turn
    about x.

    Args:
        gravity_b: unit vector of gravity in the palm frame.
    """
    x, y, z = np.asarray(gravity_b, float) / np.linalg.norm(gravity_b)
    if 1.0 - z < 1e-9:
        return np.array([0.0, 1.0, 0.0, 0.0])
    quat = np.array([1.0 - z, -y, x, 0.0])
    return quat / np.linalg.norm(quat)
