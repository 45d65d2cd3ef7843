"""What remains unexplained although causes are named: signs of a wrong model.

The true effect removes its own error, from every residual, at parameters that the joint
can have. A wrong one that comes near

- leaves an error of the simulated motion that is more than noise,
- leaves one that depends on where the joint is (`dependence`),
- needs a parameter beyond the range of the effect,
- does not bring the simulated motion nearer to the measured one, or
- moves nominal parameters of the simulation far off their priors.

What happens now and then, and not again when the motion is repeated, passes for noise;
but noise of readings has no outliers: on 36 effect-free records none lies beyond 6.5
standard deviations. Where an effect is named, sticking that ends a little earlier in
one repeat than in the next is expected of the mechanics; the controller does not stick.
A target that arrives out of turn makes a step of the effort, of which the joint's
inertia leaves little in the angle: where the effort was logged, both are looked at. But
without a low-pass every target is such a step, and clocks decide which readings see it.
"""

from dataclasses import dataclass

import numpy as np

from sysid.diagnosis.fits.candidate import (
    CONVERGED,
    Model,
    fit_models,
    log_likelihood_gain,
)
from sysid.diagnosis.fits.problem import Problem
from sysid.diagnosis.likelihood.whitening import bulk_deviation
from sysid.diagnosis.replay.band import sample_rows
from sysid.diagnosis.search.by_angle import nearest
from sysid.diagnosis.search.remains import leaves_much
from sysid.diagnosis.search.search import Search
from sysid.diagnosis.search.selection import MODEL_ERROR, PLAUSIBLE_SD
from sysid.diagnosis.simulated.output_error import OutputProblem
from sysid.diagnosis.simulated.settled_output import settled_output
from sysid.diagnosis.verdict.dependence import depends_on

OUTLIER_SD = 8.0
"""Standard deviations of the noise that no sample of it reaches."""

PRIOR_NOISE_SD = 3.0
"""Standard deviations that a jump exceeds too, of the noise before a cause was found,
and of what a cycle of a servo makes of an angle at speed: with one that removes nearly
all, steps of an encoder look like jumps."""


@dataclass(frozen=True, eq=False)
class _Left:
    """What a search leaves of the motion.

    Attributes:
        problem: whose residuals those are: of the simulated angle, if there is one.
        base: the nominal model.
        best: with the causes.
        sure: whether its noise is known apart from what is left.
    """

    problem: Problem
    base: Model
    best: Model
    sure: bool


def unexplained_signs(found: Search) -> list[str]:
    """Returns what speaks for something that no named effect explains."""
    joint = found.problem.data.joint
    left = _left(found)
    texts = [
        *_remaining(left),
        *_depending(left),
        *_no_nearer(found),
        *_at_bounds(found),
        *_off_prior(found),
        *_irregular(left),
        *_irregular_effort(found, left),
    ]
    return [f"{joint}: {text}" for text in texts]


def _left(found: Search) -> _Left:
    """Fits the simulation with the causes to the angle, where there is one.

    An equation of means over steps knows no moment at which a limit is met, and needs
    repeats to know its noise. The error of the angle has that of an encoder, which
    neighbouring samples do not share.
    """
    problem, base, best, judge = found.problem, found.base, found.best, found.judge
    if isinstance(problem, OutputProblem):
        if problem.repeat:
            return _Left(problem, base, best, sure=True)
        # What the search took for noise may be all that is left.
        problem, best = settled_output(problem, best)
        base = fit_models(problem, [()], [base.fit.theta], rounds=CONVERGED)[0]
        return _Left(problem, base, best, sure=True)
    sure = isinstance(judge.output, OutputProblem) or bool(problem.repeat)
    return _Left(judge.output, nearest(judge, base), nearest(judge, best), sure)


def _remaining(left: _Left) -> list[str]:
    """Finds residuals with much more than noise."""
    texts = []
    for k, name in enumerate(left.problem.channels):
        before, after = left.base.errors[k], left.best.errors[k]
        if left.sure and leaves_much(before, after):
            times = np.sqrt(after)
            texts.append(f"the {name} residual is {times:.1f} times the noise")
    return texts


def _depending(left: _Left) -> list[str]:
    """Finds an error of the simulated angle that depends on that angle.

    What was read has the error's own noise in it, which a joint at rest would show.
    """
    problem, theta = left.problem, left.best.fit.theta[None]
    if not isinstance(problem, OutputProblem):
        return []
    track, k = problem.data.track, problem.channels.index("position")
    error = problem.raw(theta, weigh=False)[0, k]
    angle = np.asarray(track.pos, float)[sample_rows(len(track.cmd))] - error
    if not depends_on(problem.weight[k] * error, angle, problem.valid[k]):
        return []
    return ["the position residual depends on the position"]


def _no_nearer(found: Search) -> list[str]:
    """Finds causes that together do not lower the error of the simulated angle."""
    causes = found.best.effects
    if not causes or not found.judge.sees:
        return []
    worse, better = found.judge.pair(found.base, found.best)
    nearer = found.judge.t_value(worse, better) > 0.0
    if nearer and _squared(found, better) <= _squared(found, worse):
        return []
    return [f"with {' and '.join(causes)} the simulated motion comes no nearer"]


def _squared(found: Search, model: Model) -> float:
    """Returns Σ e² of the held-out angle, of all samples alike, as it is reported.

    The judge hardly counts an angle at speed. An effect may be right and what the model
    makes of a jump wrong: then more than that effect is missing.
    """
    return float(np.sum(found.judge.error(model)[found.judge.valid] ** 2))


def _at_bounds(found: Search) -> list[str]:
    """Finds sizes at the far end of their range."""
    slots, fit = found.problem.space.slots, found.best.fit
    return [
        f"{slots[i].label} met its bound"
        for i in fit.bounded
        if slots[i].effect in found.best.effects
        and slots[i].is_size
        and fit.theta[i] != 0.0
    ]


def _off_prior(found: Search) -> list[str]:
    """Finds nominal parameters that the causes need elsewhere.

    The model error of a large effect may move a parameter that belongs to no effect.
    """
    slots, best = found.problem.space.slots, found.best
    texts, least = (
        [],
        MODEL_ERROR * log_likelihood_gain(found.base, best, found.samples),
    )
    for i in best.fit.free if best.effects else ():
        slot = slots[i]
        if slot.effect in best.effects or not np.isfinite(slot.prior_sd):
            continue
        away = slot.shift(best.fit.theta[i])
        if away > PLAUSIBLE_SD and (slot.effect or 0.5 * away**2 > least):
            how_far = f"{away:.0f} prior standard deviations"
            texts.append(f"{slot.label} lies {how_far} from nominal")
    return texts


def _irregular(left: _Left) -> list[str]:
    """Finds what does not recur in repeats of the motion."""
    problem, best = left.problem, left.best
    sticks = {"mechanics", "position"} if best.effects else set()
    return _jumping(problem, best, set(problem.channels) - sticks)


def _irregular_effort(found: Search, left: _Left) -> list[str]:
    """Finds what does not recur in the logged effort, beside a simulated angle."""
    problem = found.problem
    if isinstance(problem, OutputProblem):
        problem = problem.equations
    if problem is None or problem is left.problem:
        return []
    path = problem.space.values(problem.space.nominal[None])[0]["lowpass_cutoff"]
    if not np.isfinite(path["cutoff_hz"][0]):
        return []
    return _jumping(problem, found.best, {"controller"})


def _jumping(problem: Problem, best: Model, names: set[str]) -> list[str]:
    """Finds jumps that do not repeat in the residuals of these names."""
    if not problem.repeat:
        return []
    raw = problem.raw(best.fit.theta[None])[0]
    return [
        f"the {name} residual has jumps that do not repeat"
        for k, name in enumerate(problem.channels)
        if name in names and _jumps(problem, raw[k], k)
    ]


def _jumps(problem: Problem, raw: np.ndarray, k: int) -> bool:
    """Whether the difference of repeats has outliers.

    Weighted w = 1 / √(1 + (u / s)²), one that is uncertain by u may differ by w u =
    s √(1 − w²), however quiet the others are: cycles of a servo need not all differ.
    """
    series, valid = problem.differences(raw, problem.valid[k])
    if not valid.any():
        return False
    x, weight = np.abs(series[valid]), problem.weight[k]
    # Where weights differ, most samples may be quiet: a normal one is below twice its
    # deviation in 95 of 100.
    spread = max(np.median(x) / 0.6745, np.quantile(x, 0.95) / 1.96)
    even, _ = problem.differences(raw / weight, problem.valid[k])
    unsure = bulk_deviation(even[valid]) * np.sqrt(1.0 - weight[valid] ** 2)
    noise = np.maximum(problem.noise[k].deviation, unsure)
    least = np.maximum(OUTLIER_SD * spread, PRIOR_NOISE_SD * noise)
    return bool(np.any(x > least))
