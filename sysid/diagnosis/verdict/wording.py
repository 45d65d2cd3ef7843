"""The words of a diagnosis: warnings, what to record next, and the summary."""

from collections.abc import Sequence

import numpy as np

from envs.actuator.catalogue import CATALOGUE
from sysid.diagnosis.search.search import Search
from sysid.result import Alternative, Cause, Gain, Hypothesis, Verdict

SURE = 0.9
"""Probability of no effect above which a joint is not spoken of."""

SPOKEN = 3
"""Number of hypotheses about a joint that are spoken of."""


def warnings_of(found: Search) -> list[str]:
    """Names bounds that were met and nominal parameters far off their priors."""
    slots, fit = found.problem.space.slots, found.best.fit
    joint = found.problem.data.joint
    texts = [
        f"{joint}: {slots[i].label} met its bound"
        for i in fit.bounded
        if slots[i].effect in found.best.effects
    ]
    for i in fit.free:
        slot = slots[i]
        if slot.effect in found.best.effects or not np.isfinite(slot.prior_sd):
            continue
        away = slot.shift(fit.theta[i])
        if away > 4.0:
            how_far = f"{away:.0f} prior standard deviations"
            texts.append(f"{joint}: {slot.label} lies {how_far} from nominal")
    if not found.problem.repeat:
        texts.append(f"{joint}: no repeats, so the noise floor is not known")
    return texts


def next_experiment(
    verdict: Verdict,
    causes: Sequence[Cause],
    alternatives: Sequence[Alternative],
    blind: Sequence[str],
) -> str:
    """Proposes what to record next."""
    if verdict == "ambiguous":
        nearest = next(a for a in alternatives if not a.distinguishable)
        other, first = nearest.effect, nearest.cause or causes[0].effect
        hint = CATALOGUE[first].confusable_with.get(other)
        hint = hint or CATALOGUE[other].confusable_with.get(first)
        hint = hint or "another gain of the controller, and another load"
        return f"To distinguish {first} from {other}: {hint}."
    if verdict == "unexplained":
        return (
            "Repeat one motion three times alone, slowly and fast, with and without "
            "load, to see what the remaining error depends on."
        )
    if verdict == "not_observable":
        shown = ", ".join(blind[:6])
        return (
            "Record large steps, slow triangles with reversals, holds under load and "
            f"stalls; these records cannot show {shown}."
        )
    return ""


def summary_of(
    verdict: Verdict,
    causes: Sequence[Cause],
    alternatives: Sequence[Alternative],
    gain: Gain | None,
    blind: Sequence[str],
    signs: Sequence[str],
) -> str:
    """Says the verdict in two sentences."""
    if verdict == "none":
        return "The simulation agrees with the records within noise and tolerances."
    if verdict == "not_observable":
        shown = ", ".join(blind[:8]) or "any effect"
        return (
            "No difference beyond noise and tolerances; these records could not have "
            f"shown {shown}."
        )
    if verdict == "unexplained" and not causes:
        return "Something is there that no known effect explains: " + "; ".join(signs)
    names = " and ".join(f"{c.effect} ({c.where})" for c in causes)
    share = ""
    if gain is not None:
        before, after = gain.heldout_rmse_before, gain.heldout_rmse_after
        share = (
            " On data that the fit did not see the error falls from "
            f"{before:.3g} to {after:.3g} {gain.unit}."
        )
    if verdict == "unexplained":
        return f"Known effects explain too little; the nearest is {names}.{share}"
    if verdict == "ambiguous":
        return f"The simulation lacks {names}, or {_instead(alternatives)}.{share}"
    return f"The simulation lacks {names}.{share}"


def probable(posterior: Sequence[Hypothesis]) -> list[tuple[str, str, float]]:
    """Says what is probable of the joints that may have an effect.

    Args:
        posterior: hypotheses, the most probable of each joint first.

    Returns:
        Joint, hypothesis in words and its probability.
    """
    joints: dict[str, list[Hypothesis]] = {}
    for h in posterior:
        joints.setdefault(h.joint, []).append(h)
    return [
        (joint, _named(h.effects), h.probability)
        for joint, said in joints.items()
        if said[0].effects != () or said[0].probability < SURE
        for h in said[:SPOKEN]
    ]


def _named(effects: tuple[str, ...] | None) -> str:
    """Names a set of effects."""
    if effects is None:
        return "none of these"
    return " and ".join(effects) or "no effect"


def _instead(alternatives: Sequence[Alternative]) -> str:
    """Says which effects may stand in the place of which causes."""
    same: dict[str, list[str]] = {}
    for a in alternatives:
        if not a.distinguishable:
            same.setdefault(a.cause, []).append(a.effect)
    return " and ".join(
        f"one of {', '.join(effects)} instead of {cause}"
        for cause, effects in same.items()
    )
