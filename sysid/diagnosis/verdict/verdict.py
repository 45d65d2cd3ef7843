"""From searches joint by joint to one verdict in words and numbers."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from envs.actuator.catalogue import CATALOGUE
from sysid.diagnosis.search.candidate import Model, gain_nat
from sysid.diagnosis.search.coupling import EFFECT as PULLED
from sysid.diagnosis.search.intervals import deviations
from sysid.diagnosis.search.parameters import Slot
from sysid.diagnosis.search.problem import CHANNELS
from sysid.diagnosis.search.search import Search
from sysid.diagnosis.search.selection import THRESHOLD
from sysid.diagnosis.search.stage import NEARLY, NESTED
from sysid.diagnosis.verdict.improvement import residual_gains
from sysid.diagnosis.verdict.unexplained import left_over
from sysid.diagnosis.verdict.wording import next_experiment, summary_of, warnings_of
from sysid.mechanism import Mechanism
from sysid.result import Alternative, Cause, Estimate, Gain

WIDER = 2.5
"""Half the width of a 95 % interval in deviations; measured on other hidden cases."""

SURE = 3.0
"""Gap below which two effects cannot be told apart [nat]."""

SEEN = 12.0
"""Gain from which on an effect counts as seen [nat]."""

DARK = 0.6
"""Share of the effects that records must hide to tell nothing."""


def verdict_of(examined: Sequence[Any], mechanism: Mechanism, seed: int) -> dict:
    """Returns the fields of a `Diagnosis` that the searches decide."""
    searched = [e for e in examined if e.search is not None]
    warnings = [
        f"{e.track.joint} does not move in these records, or too fast for their rows, "
        "and was not examined"
        for e in examined
        if e.search is None
    ]
    if not searched:
        return _fields("not_observable", warnings=warnings, blind=tuple(CATALOGUE))
    gains = {e.track.joint: _gains_of(e, mechanism, seed) for e in searched}
    causes = _causes(searched, mechanism)
    warnings += [w for e in searched for w in warnings_of(e.search)]
    blind = _blind(searched)
    left = [text for e in searched for text in left_over(e.search)]
    first = _leading(searched, causes)
    gain = _main(gains[first.track.joint]) if causes else None
    rivals = _alternatives(first.search) if causes else ()
    verdict = _word(causes, rivals, left, searched, blind)
    return _fields(
        verdict,
        causes=tuple(causes),
        alternatives=rivals,
        gain=gain,
        residual_gains=gains[first.track.joint],
        advice=next_experiment(verdict, causes, rivals, blind),
        blind=blind,
        left=tuple(left),
        warnings=warnings,
    )


def _fields(verdict, causes=(), alternatives=(), gain=None, residual_gains=None,
            advice="", blind=(), left=(), warnings=()):  # fmt: skip
    """Names the fields of a `Diagnosis`."""
    if verdict == "not_observable" and not advice:
        advice = next_experiment(verdict, (), (), blind)
    return {
        "verdict": verdict,
        "causes": tuple(causes),
        "alternatives": tuple(alternatives),
        "gain": gain,
        "next_experiment": advice,
        "residual_gains": residual_gains or {},
        "not_observable": tuple(blind),
        "unexplained": tuple(left),
        "warnings": tuple(warnings),
        "summary": summary_of(verdict, causes, alternatives, gain, blind, left),
    }


def _gains_of(examined, mechanism: Mechanism, seed: int) -> dict[str, Gain]:
    linear = mechanism.is_slide(examined.track.joint)
    torque = "N" if linear else "N·m"
    units = {"position": "m" if linear else "rad", "controller": torque}
    return residual_gains(examined.search, {**units, "mechanics": torque}, seed)


def _word(causes, rivals, left, searched, blind) -> str:
    """Chooses the verdict."""
    if left:
        return "unexplained"
    if causes:
        same = any(not r.distinguishable for r in rivals)
        return "ambiguous" if same else "found"
    candidates = len(searched[0].search.problem.space.effects)
    return "not_observable" if len(blind) > DARK * candidates else "none"


def _causes(searched, mechanism: Mechanism) -> list[Cause]:
    """Joins the causes of all joints by effect, in order of gain."""
    by_effect: dict[str, list] = {}
    for e in searched:
        for effect in e.search.best.effects:
            by_effect.setdefault(effect, []).append(e)
    causes = []
    for effect, members in by_effect.items():
        joints = tuple(e.track.joint for e in members)
        places = _places(joints, mechanism, searched)
        if effect == PULLED:  # each has another joint that pulls
            places = [(joint, (joint,)) for joint in joints]
        for where, inside in places:
            chosen = [e for e in members if e.track.joint in inside]
            evidence = sum(_evidence(e.search, effect) for e in chosen)
            other = chosen[0].track.other if effect == PULLED else ""
            found = _pooled(chosen, effect)
            causes.append(Cause(effect, where, found, evidence, other))
    return sorted(causes, key=lambda c: -c.evidence)


def _evidence(found: Search, effect: str) -> float:
    """Gain of the best model over the one without the effect."""
    best = found.best
    without = found.without.get(effect, found.base)
    return round(gain_nat(without, best, found.samples), 3)


def _places(joints, mechanism: Mechanism, searched):
    """Returns the class that the joints are, or each of them by its name."""
    present = {e.track.joint for e in searched}
    if len(present) == 1:
        return [(joints[0], joints)]
    if set(joints) == present and len(present) > 1:
        return [("all", joints)]
    for name, members in mechanism.classes.items():
        inside = present.intersection(members)
        if len(inside) > 1 and set(joints) == inside:
            return [(name, joints)]
    return [(joint, (joint,)) for joint in joints]


def _pooled(members, effect: str) -> dict[str, Estimate]:
    """Mean of the joints' estimates, with an interval that holds them all."""
    each = [estimates(e.search, e.search.best, effect) for e in members]
    pooled = {}
    for name, one in each[0].items():
        values = [x[name] for x in each]
        pooled[name] = Estimate(
            float(np.mean([v.value for v in values])),
            min(v.low for v in values),
            max(v.high for v in values),
            one.unit,
        )
    return pooled


def estimates(found: Search, model: Model, effect: str) -> dict[str, Estimate]:
    """Returns the parameters of an effect with their 95 % intervals."""
    space, theta = found.problem.space, model.fit.theta
    sigma = deviations(found.problem, model, found.samples)
    return {
        space.slots[i].name: _interval(space.slots[i], theta[i], WIDER * sigma[i])
        for i in space.of(effect)
    }


def _interval(slot: Slot, u: float, half: float) -> Estimate:
    """Turns an interval of the coordinate into one of the parameter."""
    ends = [float(slot.value(np.array(x))) for x in (u - half, u + half)]
    value = float(slot.value(np.array(u)))
    low, high = min(ends), max(ends)
    if slot.kind == "linear" and slot.low == 0.0:
        low = max(low, 0.0)
    big = 1e9
    return Estimate(min(value, big), min(low, big), min(high, big), slot.unit)


def _leading(searched, causes):
    """Returns the joint to which the first cause belongs."""
    if not causes:
        return searched[0]
    effect = causes[0].effect
    return max(
        (e for e in searched if effect in e.search.best.effects),
        key=lambda e: _evidence(e.search, effect),
    )


def _alternatives(found: Search) -> tuple[Alternative, ...]:
    """Returns the rivals of the strongest cause, and those like one of the others."""
    first, *others = sorted(found.best.effects, key=lambda e: -_evidence(found, e))
    alike = [
        rival
        for cause in others
        for rival in _rivals(found, cause)
        if not rival.distinguishable
    ]
    return (*_rivals(found, first), *alike)


def _rivals(found: Search, cause: str) -> list[Alternative]:
    """Returns the effects that could stand in the place of a cause, nearest first.

    Dry friction over a presliding range of nothing, say, is the cause itself in another
    dress.
    """
    gain = _evidence(found, cause)
    without = found.without.get(cause, found.base)
    result = []
    for model in found.rivals.get(cause, []):
        effect = next(e for e in model.effects if e not in found.best.effects)
        gap = gain - gain_nat(without, model, found.samples)
        told = gap > max(SURE, NEARLY * gain) or effect in NESTED.get(cause, ())
        # Chance alone gives some effects as much as a figure's small step is worth.
        told = told or (gain - gap < THRESHOLD and not _confusable(effect, cause))
        if np.isfinite(gap) and gap < 0.9 * gain:
            result.append(Alternative(effect, round(gap, 3), bool(told), cause))
    return sorted(result, key=lambda a: a.score_gap)[:8]


def _confusable(one: str, other: str) -> bool:
    """Tells whether two effects leave like traces."""
    pair = CATALOGUE[one].confusable_with, CATALOGUE[other].confusable_with
    return other in pair[0] or one in pair[1]


def _blind(searched) -> tuple[str, ...]:
    """Returns effects that no joint's records could show."""
    sets = [set(blind_effects(e.search)) for e in searched]
    common = set.intersection(*sets)
    return tuple(name for name in CATALOGUE if name in common)


def blind_effects(found: Search) -> list[str]:
    """Returns effects whose smallest size that matters leaves no trace here."""
    problem, model = found.problem, found.best
    space = problem.space
    names = [e for e in space.effects if e not in model.effects]
    thetas, owners = [], []
    for name in names:
        for index in space.of(name):
            slot = space.slots[index]
            if slot.effect and (not slot.vanishes or slot.name not in _shapes(name)):
                theta = model.fit.theta.copy()
                theta[index] = _matters(slot)
                thetas.append(theta)
                owners.append(name)
    rs = problem.residual(np.stack(thetas)) - model.fit.residual
    scale = max(1.0, model.score / max(found.samples, 1))
    best = {name: 0.0 for name in names}
    for name, r in zip(owners, rs, strict=True):
        best[name] = max(best[name], _lonely(found, r, space.of(name)) / scale)
    return [name for name in names if best[name] < 2.0 * SEEN]


def _lonely(found: Search, r: Float[np.ndarray, " r"], own: list[int]) -> float:
    """Returns the squared change that no other figure takes back.

    Args:
        found: a search.
        r: change of the residual.
        own: coordinates of what changed.
    """
    fit, effects = found.best.fit, found.best.effects
    others = ~np.isin(fit.free, own)
    deviation = found.problem.space.deviations(effects)[fit.free[others]]
    j = np.concatenate([fit.jacobian[:, others], np.diag(1.0 / deviation)])
    q, _ = np.linalg.qr(j)
    taken = q.T @ np.concatenate([r, np.zeros(len(deviation))])
    return float(r @ r - taken @ taken)


def _shapes(effect: str) -> set[str]:
    """Parameters that only shape an effect."""
    return {n for n, p in CATALOGUE[effect].parameters.items() if p.identity is None}


def _matters(slot: Slot) -> float:
    """Coordinate of the smallest size that would matter."""
    if slot.effect == "torque_limit":
        # Loads ask for more torque than these records did: a limit matters above it.
        return 0.9 * slot.base
    if slot.kind == "reciprocal":
        return 1.1 * slot.base if slot.base > 0.0 else 1.1
    if slot.kind == "log":
        return slot.base + 0.1
    if slot.comb:
        return 0.1
    if slot.starts:
        grid = [u for u in slot.starts if u > 0.0]
        return slot.base + sorted(grid)[len(grid) // 2]
    return slot.base + 0.1


def _main(gains: dict[str, Gain]) -> Gain:
    """Chooses the gain to tell first: of the residual that differed most."""

    def differs(gain: Gain) -> float:
        return gain.heldout_rmse_before / (gain.noise_floor or gain.heldout_rmse_after)

    return max((gains[name] for name in CHANNELS if name in gains), key=differs)
