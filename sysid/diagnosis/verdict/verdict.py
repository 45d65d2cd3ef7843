"""From searches joint by joint to one verdict in words and numbers."""

from collections.abc import Sequence

from envs.actuator.catalogue import CATALOGUE
from sysid.diagnosis.search.search import Examined
from sysid.diagnosis.verdict.alternatives import alternatives_of
from sysid.diagnosis.verdict.causes import causes_of, evidence
from sysid.diagnosis.verdict.improvement import residual_gains
from sysid.diagnosis.verdict.observability import common_blind_effects
from sysid.diagnosis.verdict.posterior import hypotheses_of
from sysid.diagnosis.verdict.unexplained import unexplained_signs
from sysid.diagnosis.verdict.wording import next_experiment, summary_of, warnings_of
from sysid.mechanism import Mechanism
from sysid.result import (
    Alternative,
    Cause,
    Diagnosis,
    Gain,
    Hypothesis,
    Verdict,
)

BLIND_SHARE = 0.6
"""Share of the effects that records must hide to be called not observable."""


def verdict_of(
    examined: Sequence[Examined], mechanism: Mechanism, seed: int
) -> Diagnosis:
    """Returns the diagnosis, still without the records' digests and the time taken."""
    searched = [e for e in examined if e.search is not None]
    warnings = [
        f"{e.track.joint} does not move in these records, or too fast for their rows, "
        "and was not examined"
        for e in examined
        if e.search is None
    ]
    if not searched:
        return _diagnosis(
            "not_observable", seed, blind=tuple(CATALOGUE), warnings=warnings
        )
    gains = {e.track.joint: _gains_of(e, mechanism, seed) for e in searched}
    causes = causes_of(searched, mechanism)
    warnings += [w for e in searched for w in warnings_of(e.found)]
    blind = common_blind_effects(searched)
    signs = {e.track.joint: unexplained_signs(e.found) for e in searched}
    first = _leading(searched, causes)
    same = {e.track.joint: _alternatives(e) for e in searched}
    alternatives = same[first.track.joint]
    hidden = len(blind) > BLIND_SHARE * len(searched[0].found.problem.space.effects)
    posterior = [
        h
        for e in searched
        for j in [e.track.joint]
        for h in hypotheses_of(e.found, same[j], bool(signs[j]))
    ]
    texts = tuple(text for some in signs.values() for text in some)
    return _diagnosis(
        _word(causes, alternatives, texts, hidden),
        seed,
        causes=tuple(causes),
        alternatives=alternatives,
        residual_gains=gains[first.track.joint],
        posterior=tuple(posterior),
        blind=blind,
        signs=texts,
        warnings=warnings,
    )


def _diagnosis(
    verdict: Verdict,
    seed: int,
    *,
    causes: tuple[Cause, ...] = (),
    alternatives: tuple[Alternative, ...] = (),
    residual_gains: dict[str, Gain] | None = None,
    posterior: tuple[Hypothesis, ...] = (),
    blind: tuple[str, ...] = (),
    signs: tuple[str, ...] = (),
    warnings: Sequence[str] = (),
) -> Diagnosis:
    """Adds advice and summary to what was found."""
    gain = _largest(residual_gains) if causes and residual_gains else None
    return Diagnosis(
        verdict=verdict,
        causes=causes,
        alternatives=alternatives,
        gain=gain,
        next_experiment=next_experiment(verdict, causes, alternatives, blind),
        log_sha256=(),
        seed=seed,
        runtime_s=0.0,
        residual_gains=residual_gains or {},
        posterior=posterior,
        not_observable=blind,
        unexplained=signs,
        warnings=tuple(warnings),
        summary=summary_of(verdict, causes, alternatives, gain, blind, signs),
    )


def _alternatives(examined: Examined) -> tuple[Alternative, ...]:
    found = examined.found
    return alternatives_of(found) if found.best.effects else ()


def _gains_of(examined: Examined, mechanism: Mechanism, seed: int) -> dict[str, Gain]:
    linear = mechanism.is_slide(examined.track.joint)
    torque = "N" if linear else "N·m"
    units = {"position": "m" if linear else "rad", "controller": torque}
    return residual_gains(examined.found, {**units, "mechanics": torque}, seed)


def _word(
    causes: Sequence[Cause],
    alternatives: Sequence[Alternative],
    signs: Sequence[str],
    hidden: bool,
) -> Verdict:
    """Chooses the verdict; `hidden`: whether the records show next to nothing."""
    if signs:
        return "unexplained"
    if causes:
        same = any(not a.distinguishable for a in alternatives)
        return "ambiguous" if same else "found"
    return "not_observable" if hidden else "none"


def _leading(searched: Sequence[Examined], causes: Sequence[Cause]) -> Examined:
    """Returns the joint to which the first cause belongs."""
    if not causes:
        return searched[0]
    effect = causes[0].effect
    return max(
        (e for e in searched if effect in e.found.best.effects),
        key=lambda e: evidence(e.found, effect),
    )


def _largest(gains: dict[str, Gain]) -> Gain | None:
    """Chooses the gain that differed most, of the equations' residuals if they fall."""

    def differs(gain: Gain) -> float:
        return gain.heldout_rmse_before / (gain.noise_floor or gain.heldout_rmse_after)

    equations = [gain for name, gain in gains.items() if name != "position"]
    fall = [
        gain
        for gain in equations or gains.values()
        if gain.heldout_rmse_after < gain.heldout_rmse_before
    ]
    return max(fall, key=differs, default=None)
