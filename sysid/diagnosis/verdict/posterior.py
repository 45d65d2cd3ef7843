"""How probable each set of causes of a joint is: a calibrated posterior.

The likelihoods of simulations that are not exact are too sure of themselves: with a
large gain grows what its model errs by. So logarithms of likelihoods are tempered, the
more the larger they are, and how much is measured, on hidden cases of
which the truth is known (`benchmarks.diagnosis.calibration`).
"""

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np

from sysid.diagnosis.search.search import Search
from sysid.diagnosis.verdict.evidence import evidence
from sysid.result import Alternative, Hypothesis

Effects = tuple[str, ...]
"""A set of effects, sorted; () for none."""

LEAST = 0.01
"""Probability below which a hypothesis is not reported."""

LEAST_GAIN = 1e-6
"""Largest gain that is none."""


@dataclass(frozen=True)
class Calibration:
    """Constants of the posterior, natural logarithms.

    Attributes:
        temper: λ, weight of the share that a set explains.
        effect_cost: c, prior odds against each effect.
        named: δ, by how much they are less where the verdict names the set.
        left, clean: odds of none of these where something remains unexplained, and
            where nothing does.
    """

    temper: float
    effect_cost: float
    named: float
    left: float
    clean: float


CALIBRATION = Calibration(0.67, 5.56, 4.20, 0.0, -4.43)
"""Fitted by `benchmarks.diagnosis.calibration` to 783 joints of battery seeds 5635306,
12592899 and 6491020."""


def posterior(
    log_likelihoods: Mapping[Effects, float],
    named: Collection[Effects],
    left: bool,
    by: Calibration = CALIBRATION,
) -> dict[Effects | None, float]:
    """Probabilities of sets of effects S, and of none of them.

        P(S) = (1 − P₀) w(S) / Σ w,   P₀ = 1 / (1 + e^{−o})
        log w(S) = λ (g / G) ln(1 + G) − (c − δ [S named]) |S|

    with the gain g = ℓ(S) − ℓ(∅) and its largest value G > 0: shares of what can be
    explained decide, and the more of it there is the less by its amount.

    Args:
        log_likelihoods: ℓ on stretches that no fit saw, of every set that was fitted.
        named: the chosen set, and those that the records do not distinguish from it.
        left: whether something remains that none of them explains.
        by: the constants.

    Returns:
        Probabilities that add up to 1 [1]; that of none of these under None.

    Source:
        Tempered posterior: P. Grünwald and T. van Ommen, Inconsistency of Bayesian
        Inference for Misspecified Linear Models, and a Proposal for Repairing It,
        Bayesian Analysis 12(4), 2017; calibration of a score on held-out cases: J.
        Platt, Probabilistic Outputs for Support Vector Machines, 1999.

    Examples:
        >>> found = posterior({(): -40.0, ("deadband",): 0.0}, [("deadband",)], False)
        >>> max(found, key=found.get)
        ('deadband',)
    """
    sets = list(log_likelihoods)
    gain = np.array(list(log_likelihoods.values())) - log_likelihoods[()]
    most = max(float(gain.max()), LEAST_GAIN)
    weight = by.temper * gain / most * math.log1p(most)
    cost = by.effect_cost - by.named * np.array([s in named for s in sets])
    weight -= cost * np.array([len(s) for s in sets])
    weight = np.exp(weight - np.max(weight))
    none_of_these = 1.0 / (1.0 + math.exp(-(by.left if left else by.clean)))
    share = (1.0 - none_of_these) * weight / weight.sum()
    return {**dict(zip(sets, share.tolist(), strict=True)), None: none_of_these}


def named_sets(
    chosen: Collection[str], alternatives: Collection[tuple[str, str]]
) -> set[Effects]:
    """The sets that a verdict names: S*, and S* with a cause exchanged.

    Args:
        chosen: the effects of S*.
        alternatives: pairs of an effect and the cause in whose place it may be.

    Source:
        Ours.

    Examples:
        >>> sorted(named_sets(["deadband"], [("backlash", "deadband")]))
        [('backlash',), ('deadband',)]
    """
    named = {tuple(sorted(chosen))}
    for effect, cause in alternatives:
        named.add(tuple(sorted({effect, *chosen} - {cause})))
    return named


def hypotheses_of(
    found: Search, alternatives: Collection[Alternative], left: bool
) -> tuple[Hypothesis, ...]:
    """The hypotheses about one joint that are not improbable, most probable first.

    Args:
        found: its search.
        alternatives: effects that could stand in the place of its causes.
        left: whether something remains that its causes do not explain.

    Source:
        `posterior` of `evidence`.
    """
    same = [(a.effect, a.cause) for a in alternatives if not a.distinguishable]
    said = posterior(evidence(found), named_sets(found.best.effects, same), left)
    ranked = sorted(said.items(), key=lambda item: -item[1])
    joint = found.problem.data.joint
    return tuple(Hypothesis(joint, s, p) for s, p in ranked if p >= LEAST)
