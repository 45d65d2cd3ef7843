"""Which effects does the simulation lack? Fits, held-out scores, forward and backward.

Every effect of the catalogue is fitted, from several starts, beside the nuisances. What
counts is the error on folds that the fit did not see:

    S(M) = Σ_g ‖W r_g(θ̂_{−g})‖² + Σ_i ((θ_i − θ⁰_i) / σ_i)²

with the second sum over the nuisances that stay inside their tolerances σ_i, so that a
figure far out of its tolerance is a finding and not silently absorbed.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from sysid.diagnose_link import EFFECTS as LINKED
from sysid.diagnose_model import Model, bent, error_nat, fit_models, gain_nat
from sysid.diagnose_neighbour import coupled
from sysid.diagnose_problem import CHANNELS, Problem
from sysid.diagnose_starts import starts_of

MOST = 3
"""Largest number of causes."""

REFINED = 3
"""Number of candidates whose fits are continued."""

LEAST_SHARE = 0.03
"""Least share of the held-out error above noise that a cause must remove."""

EXCESS = 1.5
"""Squared error over the noise above which something may be left to explain."""

BELIEVED = 5.0
"""Prior deviations from its figure up to which a nuisance is believed."""

BENT = 16.0
"""Penalty of figures above which a fit is also continued from the figures."""

ALIKE = 0.003
"""Share of a gain that does not decide between two effects."""

NESTED = {"coulomb_friction": ("stribeck_friction", "hysteresis")}
"""Effects that become another one at an end of their shape: they are not its rivals."""

NEARLY = 0.015
"""Share of a gain that does not decide between an effect and one that becomes it: what
gives in dry friction before it slips is less than an encoder tells."""

THRESHOLD = 18.0
"""Least gain of a cause in the logarithm of the predictive density [nat]."""

FIGURE_THRESHOLD = 7.0
"""The same of a figure that the simulation has and that leaves its tolerance [nat]."""

SPRING_THRESHOLD = 30.0
"""The same of a spring, which may ring at any frequency of a record: chance finds one
where effects without a frequency of their own find nothing; 19 to 20 nat are the most
of 40 effect-free records [nat]."""


@dataclass(frozen=True, eq=False)
class Search:
    """What a search found.

    Attributes:
        problem: with the final noise.
        base: the simulation with its nuisances fitted.
        best: the model that is chosen.
        rivals: for each cause, models in which another effect takes its place, best
            first.
        without: for each cause, the model without it.
        samples: number of residuals that count.
    """

    problem: Problem
    base: Model
    best: Model
    rivals: dict[str, list[Model]]
    without: dict[str, Model]
    samples: int

    def gain(self, worse: Model, better: Model) -> float:
        """Gain in log predictive density [nat], at the error that remains."""
        return gain_nat(worse, better, self.samples)


def search(problem: Problem) -> Search:
    """Runs the whole search on one joint.

    Without repeats it runs again with what the first result leaves as noise.
    """
    problem, base = settled(problem)
    problem = coupled(problem, base)
    found = _searched(problem, base)
    if problem.repeat or not found.best.effects:
        return found
    left = problem.raw(found.best.fit.theta[None], weigh=False)[0]
    problem = problem.with_noise(left)
    base = fit_models(problem, [()], [base.fit.theta])[0]
    return _searched(problem, base)


def _searched(problem: Problem, base: Model) -> Search:
    """Searches at a given noise."""
    samples = int(problem.counts().sum())
    best = base
    rivals: dict[str, list[Model]] = {}
    for _ in range(MOST):
        stage = extended(problem, best)
        worth = [m for m in stage if _worth(problem, best, m, base)]
        if not worth:
            break
        winner = _fullest(worth)
        again = _beside(problem, best.effects, winner.fit.theta)
        if again.fit.cost < best.fit.cost:
            worth = [m for m in worth if _worth(problem, again, m, base)]
            if not worth:
                break
            winner = _fullest(worth)
            if again.score < best.score:
                base = again if not best.effects else base
        best = _pruned(problem, winner, base)
        if best.effects != winner.effects:
            break
        if len(best.effects) == 1:
            rivals[best.effects[0]] = [m for m in stage if m is not winner]
    if len(best.effects) == 1 and best.effects[0] in rivals:
        without = {best.effects[0]: base}
    else:
        best, rivals, without = _exchanged(problem, best, base)
    return Search(problem, base, best, rivals, without, samples)


def _fullest(worth: list[Model]) -> Model:
    """Chooses the first effect, or one that explains what the first leaves.

    Where one moment alone tells a figure, folds without it do not predict that moment,
    however true the figure is.
    """
    first, full = worth[0], min(worth, key=lambda m: m.errors.max())
    left, rest = first.errors.max() - 1.0, full.errors.max() - 1.0
    return full if left > EXCESS - 1.0 and rest < 0.5 * left else first


def _worth(problem: Problem, smaller: Model, larger: Model, base: Model) -> bool:
    """Tells whether a larger model is worth its effect."""
    samples = int(problem.counts().sum())
    gain = gain_nat(smaller, larger, samples)
    added = [e for e in larger.effects if e not in smaller.effects]
    # What an equation leaves of a large effect is not another effect.
    least = ALIKE * _told(problem, smaller, larger, base)
    if all(problem.space.figured(e) for e in added):
        if any(bent(problem, smaller, e) > BELIEVED for e in added):
            # That the figure straightens is no matter of noise or of other effects.
            return error_nat(smaller, larger, samples) > FIGURE_THRESHOLD
        return gain > max(FIGURE_THRESHOLD, least)
    threshold = SPRING_THRESHOLD if "compliance" in added else THRESHOLD
    return gain > max(threshold, least) and _shares(problem, smaller, larger, base)


def _shares(problem: Problem, smaller: Model, larger: Model, base: Model) -> bool:
    """Tells whether enough of an error goes, where most of it goes.

    A large effect in one residual must not hide a small one in the other, nor one that
    the figures hide by bending out of their tolerances.
    """
    k = _strongest(problem, smaller, larger)
    noise = [*problem.counts().reshape(2, -1).sum(1), 0.0]
    removed = _parts(problem, smaller)[k] - _parts(problem, larger)[k]
    return bool(removed > LEAST_SHARE * (_parts(problem, base)[k] - noise[k]))


def _strongest(problem: Problem, smaller: Model, larger: Model) -> int:
    """Returns the part in which most of the error goes."""
    return int(np.argmax(_parts(problem, smaller) - _parts(problem, larger)))


def _told(problem: Problem, smaller: Model, larger: Model, base: Model) -> float:
    """Returns what a smaller model gains [nat] where a larger one gains most.

    What figures take up by bending may come from either residual.
    """
    gained = _parts(problem, base) - _parts(problem, smaller)
    k = _strongest(problem, smaller, larger)
    return 0.5 * float(gained.sum() if k == len(CHANNELS) else gained[k])


def _parts(problem: Problem, model: Model) -> Float[np.ndarray, "3"]:
    """Returns the squared errors of both residuals, and of the figures."""
    counts = problem.counts().reshape(2, -1).sum(1)
    return np.append(counts * model.errors, model.penalty)


def settled(problem: Problem) -> tuple[Problem, Model]:
    """Fits the nuisances and estimates the noise, twice."""
    theta = problem.space.base
    for _ in range(3):
        problem = problem.with_noise(problem.raw(theta[None], weigh=False)[0])
        model = _beside(problem, (), theta)
        theta = model.fit.theta
    return problem, model


def _beside(problem: Problem, effects: tuple[str, ...], theta: np.ndarray) -> Model:
    """Fits from where a fit is, and from delays beside it; returns the best.

    Where targets arrive just when readings are taken, the error has a kink, at which a
    fit would stay.
    """
    slots, starts = problem.space.slots, [theta]
    for i in problem.space.of("transport_delay"):
        for way in (-1.0, 1.0) if 0.0 < slots[i].tight < np.inf else ():
            moved = theta.copy()
            moved[i] = max(moved[i] + way * slots[i].tight, slots[i].low)
            starts.append(moved)
    models = fit_models(problem, [effects] * len(starts), starts)
    return min(models, key=lambda m: m.fit.cost)


def extended(problem: Problem, model: Model) -> list[Model]:
    """Adds every effect that a model lacks, best first."""
    names = [e for e in problem.space.effects if _fits_in(e, model.effects)]
    sets = [(*model.effects, name) for name in names]
    starts = starts_of(problem, model, names)
    jobs = [(s, t) for s, name in zip(sets, names, strict=True) for t in starts[name]]
    shared = dict(zip(model.fit.free.tolist(), model.fit.jacobian.T, strict=True))
    models = fit_models(problem, [j[0] for j in jobs], [j[1] for j in jobs], shared)
    best: dict[tuple, Model] = {}
    for m in models:
        if m.effects not in best or m.fit.cost < best[m.effects].fit.cost:
            best[m.effects] = m
    stage = _refined(problem, model, list(best.values()))
    return _simplest_first(problem, model, stage)


def _fits_in(effect: str, effects: tuple[str, ...]) -> bool:
    """Tells whether an effect can act beside others: one thing moves the link."""
    taken = effect in LINKED and any(e in LINKED for e in effects)
    return effect not in effects and not taken


def _refined(problem: Problem, smaller: Model, stage: list[Model]) -> list[Model]:
    """Goes on with the fits that are nearest to the records; best first."""
    samples = int(problem.counts().sum())

    def order(m: Model) -> float:
        return -gain_nat(smaller, m, samples)

    near = sorted(stage, key=lambda m: m.fit.cost)[:REFINED]
    ranked = sorted(stage, key=order)
    far = 0.9 * order(ranked[0]) if ranked else 0.0
    close = ranked[:REFINED] + [m for m in ranked[REFINED:] if order(m) < far]
    near += [m for m in close if m not in near]
    jobs = [(m.effects, m.fit.theta) for m in near]
    jobs += [(m.effects, _unbent(problem, m)) for m in near if m.penalty > BENT]
    models = fit_models(problem, [j[0] for j in jobs], [j[1] for j in jobs], rounds=10)
    models = sorted(models, key=lambda m: -m.fit.cost)
    again = {m.effects: m for m in models}  # the last one is the best
    return sorted((again.get(m.effects, m) for m in stage), key=order)


def _unbent(problem: Problem, model: Model) -> np.ndarray:
    """Returns where a fit is, but with the figures of the simulation as they stand.

    Masses, loads and rotors that a large effect has bent make up for each other: from
    there no step leads back that does not leave a narrow, curved valley.
    """
    theta = problem.space.base.copy()
    kept = [i for e in model.effects for i in problem.space.of(e)]
    theta[kept] = model.fit.theta[kept]
    return theta


def _simplest_first(
    problem: Problem, smaller: Model, stage: list[Model]
) -> list[Model]:
    """Puts the effect with the fewest parameters first among those that tie."""
    if not stage:
        return stage
    samples = int(problem.counts().sum())
    gains = {m.effects: gain_nat(smaller, m, samples) for m in stage}
    most, best = gains[stage[0].effects], stage[0].effects[-1]

    def tie(m: Model) -> bool:
        behind = most - gains[m.effects]
        if best not in NESTED.get(m.effects[-1], ()):
            return behind < max(3.0, ALIKE * most)
        # What the equation leaves of large friction is not that it falls with speed.
        left = gain_nat(m, stage[0], samples)
        return behind < max(3.0, NEARLY * most) or left < ALIKE * most

    tied = [m for m in stage if tie(m)]
    first = min(
        tied, key=lambda m: (len(problem.space.of(m.effects[-1])), -gains[m.effects])
    )
    return [first, *(m for m in stage if m is not first)]


def _pruned(problem: Problem, model: Model, base: Model) -> Model:
    """Drops effects that a larger model no longer needs."""
    while len(model.effects) > 1:
        sets = [tuple(e for e in model.effects if e != out) for out in model.effects]
        smaller = fit_models(problem, sets, [model.fit.theta] * len(sets))
        best = min(smaller, key=lambda m: m.score)
        if _worth(problem, best, model, base):
            return model
        model = best
    return model


def _exchanged(
    problem: Problem, best: Model, base: Model
) -> tuple[Model, dict[str, list[Model]], dict[str, Model]]:
    """Lets other effects take the places of causes while that is better.

    The first cause of several was chosen when it stood for all of them. One that is not
    worth it beside the others goes.

    Returns:
        The model, and for each cause its rivals and the model without it.
    """
    samples = int(problem.counts().sum())
    for _ in range(MOST):
        rivals, without = _swapped(problem, best, base)
        idle = [c for c in best.effects if not _worth(problem, without[c], best, base)]
        if idle and len(best.effects) > 1:
            best = without[idle[0]]
            continue
        for cause, stage in rivals.items():
            least = NEARLY * gain_nat(without[cause], best, samples)
            better = [
                m
                for m in stage
                if gain_nat(best, m, samples) > max(3.0, least)
                and _worth(problem, without[cause], m, base)
            ]
            if better:
                break
        else:
            return best, rivals, without
        best = _pruned(problem, better[0], base)
    return best, *_swapped(problem, best, base)


def _swapped(
    problem: Problem, best: Model, base: Model
) -> tuple[dict[str, list[Model]], dict[str, Model]]:
    """Lets every other effect take the place of each cause, and none."""
    rivals, without = {}, {}
    for cause in best.effects:
        rest = tuple(e for e in best.effects if e != cause)
        refit = fit_models(problem, [rest], [best.fit.theta])[0] if rest else base
        without[cause] = refit
        stage = extended(problem, without[cause])
        rivals[cause] = [m for m in stage if cause not in m.effects]
    return rivals, without
