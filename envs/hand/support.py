"""How far a point is inside the polygon of the fingertips that support the hand."""

import numpy as np
from jaxtyping import Float


def support_margins(
    point: Float[np.ndarray, "2"],
    tips: Float[np.ndarray, "tips 2"],
    lifted: int | None = None,
) -> Float[np.ndarray, " n"]:
    """Signed distances d_i = n_i · (p − v_i) [m] to the footprint's edges; inside > 0.

    n_i is the inner unit normal of the edge that begins at the tip v_i.

    Args:
        point: such as the centre of mass on the floor [m].
        tips: of all fingers on the floor [m].
        lifted: finger that does not support; none if not given.

    Source:
        R. McGhee, A. Frank, On the stability properties of quadruped creeping gaits,
        Mathematical Biosciences 3, 1968 (static stability margin).
    """
    around = (0, *range(len(tips) - 1, 0, -1))  # thumb, little, …, index
    start = tips[[finger for finger in around if finger != lifted]]
    edge = np.roll(start, -1, axis=0) - start
    area = np.sum(start[:, 0] * np.roll(start[:, 1], -1))
    area -= np.sum(np.roll(start[:, 0], -1) * start[:, 1])
    normal = np.stack([-edge[:, 1], edge[:, 0]], axis=1) * np.sign(area)
    normal /= np.linalg.norm(edge, axis=1, keepdims=True) + 1e-9
    return np.sum(normal * (point - start), axis=1)


def lifted_margins(
    point: Float[np.ndarray, "2"], tips: Float[np.ndarray, "tips 2"]
) -> Float[np.ndarray, " tips"]:
    """Margins with one finger lifted: m_k = min_i d_i on the other tips [m].

    Args:
        point: such as the centre of mass on the floor [m].
        tips: of all fingers on the floor [m].

    Source:
        As `support_margins`.
    """
    return np.array(
        [support_margins(point, tips, lifted).min() for lifted in range(len(tips))]
    )
