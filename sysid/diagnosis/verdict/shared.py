"""Effects of one body that several joints feel: one cause with one size.

A load hangs on one body and a mount is turned once, whichever joints show it. Every
joint is searched for itself, and the quadratic of its posterior around its optimum is
its estimate with its standard error; the sum of those quadratics over the joints that
share the body is least at the mean weighted by inverse variances. What joints of one
record err by they share (its clock, nominal masses, gravity), so the mean is not
surer than the surest of them.
"""

from collections.abc import Sequence

import numpy as np
from scipy.stats import chi2

from sysid.carried import carrying_bodies
from sysid.mechanism import Mechanism
from sysid.result import Estimate

LOADS = ("payload_mass", "payload_com")
MOUNT = "mount_tilt"

UNLIKELY = 1e-3
"""Probability of estimates that far apart below which they are not of one body."""


def sharing(
    effect: str, joints: Sequence[str], mechanism: Mechanism
) -> list[tuple[str, ...]]:
    """Returns the joints that feel one body together, in the order of the joints.

    Args:
        effect: name in the catalogue.
        joints: that have it.
        mechanism: whose bodies they are; each finger of a hand has its own load, and
            joints of fingers are joined by their classes.
    """
    if mechanism.hand is not None or effect not in (*LOADS, MOUNT):
        return [(joint,) for joint in joints]
    if effect == MOUNT:
        return [tuple(joints)]
    model = mechanism.model
    moved = model.jnt_bodyid[[model.joint(j).id for j in joints]]
    bodies = carrying_bodies(model, moved)
    return [
        tuple(j for j, other in zip(joints, bodies, strict=True) if other == body)
        for body in dict.fromkeys(bodies.tolist())
    ]


def combined(
    each: Sequence[dict[str, Estimate]], half_width: float
) -> dict[str, Estimate]:
    """x̄ = Σ w_j x_j / Σ w_j with w = 1 / σ², σ̄ = min_j σ_j, for every parameter.

    Args:
        each: estimates of every joint.
        half_width: of their intervals, and of the one that is returned [σ].

    Source:
        Mean of a product of Gaussian densities of one size; its error is ours, for
        errors that are not independent.
    """
    result = {}
    for name, one in each[0].items():
        value, sigma = _sizes([e[name] for e in each], half_width)
        total = np.sum(sigma**-2.0)
        mean, half = (
            float(value @ sigma**-2.0 / total),
            half_width * float(np.min(sigma)),
        )
        result[name] = Estimate(mean, float(mean - half), float(mean + half), one.unit)
    return result


def disagree(each: Sequence[dict[str, Estimate]], half_width: float) -> bool:
    """P(χ² ≥ Σ_j ((x_j − x̄) / σ_j)²) < `UNLIKELY` for a parameter: not one body.

    Args:
        each: estimates of every joint.
        half_width: of their intervals [σ].

    Source:
        Textbook test of homogeneity (Cochran's Q).
    """
    for name, mean in combined(each, half_width).items():
        value, sigma = _sizes([e[name] for e in each], half_width)
        apart = float(np.sum(((value - mean.value) / sigma) ** 2))
        if chi2.sf(apart, len(each) - 1) < UNLIKELY:
            return True
    return False


def _sizes(estimates: Sequence[Estimate], half_width: float):
    """Values and standard errors."""
    value = np.array([e.value for e in estimates])
    width = np.array([e.high - e.low for e in estimates])
    return value, np.maximum(width / (2.0 * half_width), 1e-12)
