"""What the fits of a walk allow to say."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from envs.actuator.catalogue import CATALOGUE
from sysid.result import Alternative, Cause, Estimate, Gain
from sysid.walking.hypotheses import Axis, Hypothesis

SURE = 3.0
"""Standard errors by which a held-out gain must exceed zero, or another one."""

BOUND = 20.0
"""Largest value of a parameter in units of its axis."""


@dataclass(frozen=True, eq=False)
class Judged:
    """One hypothesis on data that its fit never saw.

    Attributes:
        hypothesis: which.
        gains: of log density over that of the hand as simulated, by stretch [nat].
        theta: fit on the whole walk.
        half: half the widths of 95 % intervals, in units of the axes.
    """

    hypothesis: Hypothesis
    gains: Float[np.ndarray, " b"]
    theta: Float[np.ndarray, " a"]
    half: Float[np.ndarray, " a"]

    @property
    def gain(self) -> float:
        """Total gain [nat]."""
        return float(np.sum(self.gains))


def _sure(gains: np.ndarray) -> bool:
    """Whether a sum over stretches is above zero beyond chance."""
    error = np.std(gains, ddof=1) / np.sqrt(len(gains))
    return float(np.mean(gains)) > SURE * max(float(error), 1e-9)


def verdict_of(
    all_axes: tuple[Axis, ...],
    full: Sequence[Judged],
    plain: Judged,
    count: Int[np.ndarray, " b"],
) -> dict[str, Any]:
    """ΔL > 3 √(n Var ΔL_b): names a cause whose gain exceeds three standard errors.

    Args:
        all_axes: all parameters.
        full: hypotheses, best first.
        plain: the hand as simulated; its gains are minus its costs.
        count: residuals in every stretch [1].

    Returns:
        The fields of the diagnosis that the fits decide.

    Source:
        Ours: the gain in log-likelihood ΔL = Σ_b ΔL_b on held-out stretches [nat].
    """
    best, *rest = full
    if not _sure(best.gains):
        words = "Nothing significant: no effect of the whole hand predicts this walk "
        words += "better than the hand as simulated."
        return {
            "verdict": "none", "causes": (), "alternatives": (), "gain": None,
            "next_experiment": "", "summary": words,
        }  # fmt: skip
    others = tuple(
        Alternative(
            f"{j.hypothesis.effect} of {j.hypothesis.where}",
            best.gain - j.gain,
            _sure(best.gains - j.gains),
        )
        for j in rest
    )
    near = [a for a in others if not a.distinguishable]
    cause = _cause(all_axes, best)
    values = ", ".join(
        f"{k} {e.value:.3g} ({e.low:.3g} to {e.high:.3g}) {e.unit}"
        for k, e in cause.parameters.items()
    )
    words = f"{cause.effect} of {cause.where}: {values}."
    if near:
        words += f" Not distinguished from {', '.join(a.effect for a in near)}."
    return {
        "verdict": "ambiguous" if near else "found",
        "causes": (cause,),
        "alternatives": others,
        "gain": _gain(count, best, plain),
        "next_experiment": _next(cause.effect, near),
        "summary": words,
    }


def _cause(all_axes: tuple[Axis, ...], judged: Judged) -> Cause:
    found = {}
    for i in judged.hypothesis.indices:
        axis, x, half = all_axes[i], float(judged.theta[i]), float(judged.half[i])
        half = half if np.isfinite(half) else BOUND
        unit = CATALOGUE[axis.effect].units()[axis.name]
        found[axis.name] = Estimate(
            axis.value(x), axis.value(x - half), axis.value(x + half), unit
        )
    return Cause(judged.hypothesis.effect, judged.hypothesis.where, found, judged.gain)


def _gain(count: np.ndarray, best: Judged, plain: Judged) -> Gain:
    """Held-out error of the residual in units of its scatter, before and after."""
    before = -2.0 * plain.gains
    after = before - 2.0 * best.gains
    ends = [float(np.sqrt(np.sum(x) / np.sum(count))) for x in (before, after)]
    share = 2.0 * best.gains / before
    error = 1.96 * float(np.std(share, ddof=1) / np.sqrt(len(share)))
    mean = float(np.sum(2.0 * best.gains) / np.sum(before))
    return Gain(
        heldout_rmse_before=ends[0],
        heldout_rmse_after=ends[1],
        explained_fraction=mean,
        low=mean - error,
        high=mean + error,
        unit="scatter",
        noise_floor=None,
    )


def _next(effect: str, near: Sequence[Alternative]) -> str:
    """The experiment that distinguishes the cause from its nearest alternative."""
    if not near:
        return ""
    other = near[0].effect.split(" of ")[0]
    known = CATALOGUE[effect].confusable_with.get(other)
    return known or f"walk in other directions: {effect} against {other}"
