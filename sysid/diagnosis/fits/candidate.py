"""Candidates: fitted on all data, scored on folds that a fit did not see.

    S(M) = Σ_g ‖r_g(θ̂_{−g})‖² + Σ_i ((θ̂_i − θ⁰_i) / σ_i)²

with whitened residuals r_g of fold g, and the second sum over the nuisance parameters.
The parameters θ̂_{−g} without fold g are `heldout`'s.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from sysid.diagnosis.fits.heldout import held_out
from sysid.diagnosis.fits.problem import Problem
from sysid.diagnosis.likelihood.whitening import correlation_time
from sysid.diagnosis.replay.band import EVERY
from sysid.diagnosis.replay.link import MOST_ROTOR
from sysid.diagnosis.replay.noise import spring_noise_gain
from sysid.least_squares import Fit, Task, fit_all

CONVERGED = 30
"""Most steps of a fit that decides: it ends sooner where it converges. The error of a
simulated angle has narrow, curved valleys, and of two models the one that is still on
its way would seem the worse."""


@dataclass(frozen=True, eq=False)
class Model:
    """A candidate: the simulation with some effects released.

    Attributes:
        effects: the released effects.
        fit: on all data.
        score: S, the squared error on held-out folds with the prior's part.
        penalty: the prior's part, of the nuisance parameters.
        fold_theta: coordinates without each fold.
        errors: mean squared whitened residual on all data (controller, mechanics); 1
            where only noise remains. Held-out folds would not show it: a fold that
            alone excites a parameter is badly predicted without it.
        noise_cost: n log A, log-likelihood that is lost by amplified noise [1].
        correlation: samples of the residual that count as one; 1 where repeats say what
            is noise [1].
    """

    effects: tuple[str, ...]
    fit: Fit
    score: float
    penalty: float
    fold_theta: Float[np.ndarray, "g n"]
    errors: Float[np.ndarray, "2"]
    noise_cost: float
    correlation: float = 1.0

    def variance(self, samples: int) -> float:
        """Variance of a residual that counts, max(1, τ S / n) [1].

        Args:
            samples: n, number of residuals that count.

        Source:
            Ours: what remains may be noise that was not known before, or model error.
        """
        return max(1.0, self.correlation * self.score / max(samples, 1))


def log_likelihood_gain(worse: Model, better: Model, samples: int) -> float:
    """Gain in log predictive likelihood, Δ log L = ΔS / 2 s² − Δ(n log A).

    Of two springs the one that drifts to less noise gains nothing by that.
    """
    quieter = worse.noise_cost - better.noise_cost
    if worse.noise_cost > 0.0 and better.noise_cost > 0.0:
        quieter = min(quieter, 0.0)
    return heldout_gain(worse, better, samples) + quieter


def likelihood_gap(candidate: Model, best: Model, samples: int) -> float:
    """How far a candidate is behind another model that it does not contain.

        Δ log L = n / 2 τ log(1 + τ ΔS / (n s²)) + Δ(n log A),   s² = max(1, τ S / n)

    Args:
        candidate: the model that may be behind; negative if it is ahead.
        best: the model whose error S and correlation time τ count.
        samples: n, number of residuals that count.

    Source:
        Predictive likelihood of Gaussian errors of unknown variance (log of the ratio
        of error sums); τ, and known noise as the least variance, are ours. Gains over a
        common smaller model would differ by a per cent of themselves although two
        candidates are alike.
    """
    if candidate.score < best.score:
        return -likelihood_gap(best, candidate, samples)
    count = samples / best.correlation
    share = (candidate.score - best.score) / (count * best.variance(samples))
    behind = 0.5 * count * float(np.log1p(share)) if np.isfinite(share) else np.inf
    return behind + candidate.noise_cost - best.noise_cost


def fitted_gap(candidate: Model, best: Model, samples: int) -> float:
    """How far a candidate is behind another in its fit to all data.

    The formula of `likelihood_gap` with the costs C of the fits in the place of S.

    Args:
        candidate: the model that may be behind; negative if it is ahead.
        best: the other.
        samples: n, number of residuals that count.

    Source:
        Ours.
    """
    behind, ahead = (replace(m, score=m.fit.cost) for m in (candidate, best))
    return likelihood_gap(behind, ahead, samples)


def heldout_gain(worse: Model, better: Model, samples: int) -> float:
    """The part of the gain from errors, ½ min(ΔS, ΔC) / max(1, τ S / n).

    S / n is the error per sample that remains, and τ how many of them count as one. The
    cost C on all data must fall as much: a fold that alone excites a parameter is badly
    predicted from its prior, and that is not the simulation's fault.
    """
    held, fitted = worse.score - better.score, worse.fit.cost - better.fit.cost
    return 0.5 * min(held, fitted) / better.variance(samples)


def off_prior(problem: Problem, model: Model, effect: str) -> float:
    """Largest distance of an effect's parameters from nominal [prior deviations]."""
    away = [
        slot.shift(model.fit.theta[i])
        for i, slot in enumerate(problem.space.slots)
        if slot.effect == effect and 0.0 < slot.prior_sd < np.inf
    ]
    return max(away, default=0.0)


def noise_cost(problem: Problem, theta: Float[np.ndarray, " n"], error: float) -> float:
    """Log-likelihood that amplified noise costs the mechanics: Δ log L = n log A.

    Residuals are divided by the noise that a candidate would have. A spring between
    motor and link turns encoder noise into torque at its resonance: the density of n
    readings falls by Aⁿ where their noise is A times as large.

    Args:
        problem: with its noise.
        theta: coordinates of the candidate [1].
        error: mean squared whitened residual; below one where samples are correlated,
            so that fewer count.

    Returns:
        n log A [1]; zero without a spring.

    Source:
        Ours; the normalization of a Gaussian density of standard deviation A σ.
    """
    where = problem.space.of("compliance")
    if not problem.amplifies or not where or theta[where[0]] <= 0.0:
        return 0.0
    slots, track = problem.space.slots, problem.data.track
    soft, rotor = (float(slots[i].value(theta[i])) for i in where)
    whole = float(np.mean(np.asarray(track.inertia)))
    rotor = min(rotor, MOST_ROTOR * whole)
    noise = (track.noise[1, 0], track.noise[1, 3], EVERY * problem.data.dt)
    inner, spring, rest = (jnp.full((1, 1), x) for x in (rotor, soft, whole - rotor))
    gain = float(spring_noise_gain(rest, inner, spring, *noise)[0, 0])
    count = float(problem.channel_counts()[1])
    return count * min(1.0, error) * float(np.log(gain))


def fit_models(
    problem: Problem,
    sets: Sequence[tuple[str, ...]],
    starts: Sequence[Float[np.ndarray, " n"]],
    shared: dict | None = None,
    rounds: int = 5,
    nearest: bool = False,
) -> list[Model]:
    """Fits models from given starts and scores them on held-out folds.

        θ̂ = argmin_θ ‖r(θ)‖² + Σ_i ((θ_i − θ⁰_i) / σ_i)²

    Args:
        problem: residuals of a joint.
        sets: released effects of every model.
        starts: first coordinates of every model [1].
        shared: columns of the Jacobian that are taken as they are.
        rounds: Levenberg-Marquardt steps.
        nearest: whether the other fits of the same effects are of no interest: scoring
            takes as long as several steps.

    Returns:
        One model for every start; or for every set, that with the least cost first.

    Source:
        Maximum a-posteriori estimate with Gaussian noise and priors; scores: `heldout`.
    """
    tasks = [task_of(problem, s, t) for s, t in zip(sets, starts, strict=True)]
    fits = fit_all(problem.residual, tasks, rounds, shared=shared)
    order = nearest_fits(sets, fits) if nearest else range(len(fits))
    return _scored(problem, *([x[k] for k in order] for x in (sets, tasks, fits)))


def nearest_fits(sets: Sequence[tuple[str, ...]], fits: Sequence[Fit]) -> list[int]:
    """Returns the number of the best fit of every set, the least cost first."""
    best: dict[tuple[str, ...], int] = {}
    for k in sorted(range(len(fits)), key=lambda k: fits[k].cost):
        best.setdefault(tuple(sets[k]), k)
    return list(best.values())


def task_of(problem: Problem, effects: tuple[str, ...], start: np.ndarray) -> Task:
    """Returns the fit of a model with some effects released."""
    space = problem.space
    prior_sd = space.prior_sds(effects)
    free = np.flatnonzero(prior_sd > 0.0)
    start = np.where(prior_sd > 0.0, start, space.nominal)
    low = np.array([s.low for s in space.slots])
    high = np.array([s.high for s in space.slots])
    wide = np.where(prior_sd > 0, prior_sd, 1.0)
    steps = _own_steps(problem, start)
    # A limit that the smaller model does not reach has no slope there.
    fresh = tuple(space.of(effects[-1])) if effects else ()
    return Task(start, free, space.nominal, wide, low, high, steps, fresh)


def _own_steps(problem: Problem, start: np.ndarray) -> np.ndarray:
    """Returns the steps of differences of coordinates that need their own, else 0."""
    slots = problem.space.slots
    many = np.array([s.many_optima for s in slots])
    times = np.array([s.kind == "linear" and s.unit == "s" for s in slots])
    scale = np.array([s.scale for s in slots])
    near = 3e-4 * np.maximum(np.abs(start), 1e-6)
    return np.where(many, near, np.where(times, problem.time_step_s / scale, 0.0))


def _scored(problem, sets, tasks, fits) -> list[Model]:
    """Scores fits by what they predict of each fold from the others."""
    counted, models = problem.channel_counts(), []
    predicted = held_out(problem, tasks, fits)
    each = zip(sets, tasks, fits, predicted, strict=True)
    for effects, task, fit, held in each:
        errors = np.sum(fit.residual.reshape(2, -1) ** 2, 1) / np.maximum(counted, 1)
        penalty = nuisance_penalty(problem, task, effects, fit.theta)
        score = held.error + penalty if np.isfinite(held.error) else np.inf
        cost = noise_cost(problem, fit.theta, float(errors[1]))
        tau = _correlation(problem, fit)
        parts = (score, penalty, held.theta, errors, cost, tau)
        models.append(Model(tuple(effects), fit, *parts))
    return models


def _correlation(problem: Problem, fit: Fit) -> float:
    """Mean correlation time of both residuals, by how much remains of each."""
    if problem.repeat:
        return 1.0
    shape = (2, *problem.fold.shape)
    series, counts = fit.residual.reshape(shape), problem.counts().reshape(shape)
    power = np.sum(series**2, (1, 2))
    times = [correlation_time(r, c) for r, c in zip(series, counts, strict=True)]
    return float(power @ times / max(power.sum(), 1e-300))


def nuisance_penalty(
    problem: Problem, task: Task, effects: tuple[str, ...], theta: np.ndarray
) -> float:
    """Σ_i ((θ_i − θ⁰_i) / σ_i)² over all but the parameters of the effects [1].

    Args:
        problem: residuals of a joint.
        task: of the fit, with θ⁰ and σ.
        effects: released in it.
        theta: coordinates θ [1].

    Source:
        Gaussian priors.
    """
    slots = problem.space.slots
    kept = [i for i in task.free if slots[i].effect not in effects]
    return float(np.sum(((theta - task.center)[kept] / task.deviation[kept]) ** 2))
