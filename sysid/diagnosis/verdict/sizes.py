"""How large an effect is, by the residual that can say so without a bias.

The equations multiply parameters by angles that were read and by their derivatives.
What a band smooths of those, and their noise, makes sizes wrong by more than any
covariance of the residual says: errors in the variables do not average out. The error
of the simulated angle has targets for inputs, which are known, and its estimate stays
consistent. So the equations find an effect, and the angle that confirmed it says how
large it is. Where the effort alone did, or nothing can be simulated, the equations do,
and so they do where they leave noise and the simulation much more. Where the two
exclude each other one of them errs by more than its likelihood knows, and the interval
holds both.
"""

from dataclasses import replace

import numpy as np

from sysid.diagnosis.fits.candidate import Model
from sysid.diagnosis.fits.intervals import standard_errors
from sysid.diagnosis.fits.parameters import Slot
from sysid.diagnosis.fits.problem import Problem
from sysid.diagnosis.fits.profile import profiled, resolved
from sysid.diagnosis.search.remains import LEFT
from sysid.diagnosis.search.search import Search
from sysid.result import Estimate

HALF_WIDTH = 2.5
"""Half the width of a 95 % interval in standard errors; measured on other hidden
cases: models are not exact, and the normal 1.96 is too narrow."""


def sizes_of(found: Search) -> dict[str, dict[str, Estimate]]:
    """x(u) of every cause's parameters, with the ends of their 95 % intervals.

    Args:
        found: what a search found.

    Returns:
        Estimates by effect and parameter, in their units.

    Source:
        Bias of equation errors: T. Söderström, Errors-in-variables methods in system
        identification, Automatica 43(6), 2007. Closed-loop output error in their place:
        M. Gautier, A. Janot, P.-O. Vandanjon, A New Closed-Loop Output Error Method for
        Parameter Identification of Robot Dynamics, IEEE Transactions on Control Systems
        Technology 21(2), 2013. Ends: `profiled`.
    """
    effects = found.best.effects
    shown = [e for e in effects if shows(found, e)]
    rest = [e for e in effects if e not in shown]
    sizes = {}
    if shown:
        sizes |= _by_the_angle(found, shown)
    if rest:
        sizes |= _estimates(found.problem, found.best, rest)
    return {e: sizes[e] for e in effects}


def _by_the_angle(found: Search, effects: list[str]) -> dict[str, dict[str, Estimate]]:
    """Sizes by the simulated angle, beside those of the equations if there are any."""
    judge = found.judge.serving(found.best)
    model = judge.moved(found.best)
    sizes = _estimates(judge.output, model, effects)
    if judge.output is found.problem:
        return sizes
    others = _estimates(found.problem, found.best, effects)
    if model.errors.max() > LEFT > found.best.errors.max():
        sizes, others = others, sizes
    return {
        effect: {
            name: agreed(said, others[effect][name]) for name, said in each.items()
        }
        for effect, each in sizes.items()
    }


def agreed(said: Estimate, other: Estimate) -> Estimate:
    """An estimate whose interval holds that of another one, if it excludes that one.

    Args:
        said: by the residual that is taken.
        other: of the same parameter by the other residual.

    Source:
        Ours.

    Examples:
        >>> agreed(Estimate(2.0, 1.9, 2.1, "1"), Estimate(2.5, 2.4, 2.6, "1")).high
        2.6
    """
    if said.low <= other.value <= said.high:
        return said
    return replace(said, low=min(said.low, other.low), high=max(said.high, other.high))


def shows(found: Search, effect: str) -> bool:
    """Whether the simulated angle says how large an effect is."""
    return found.judge.shows(found.without.get(effect, found.base), found.best)


def _estimates(
    problem: Problem, model: Model, effects: list[str]
) -> dict[str, dict[str, Estimate]]:
    """Sizes of some effects of a model by these residuals."""
    space, model = problem.space, resolved(problem, model)
    half = HALF_WIDTH * standard_errors(problem, model, problem.samples)
    wanted = [i for e in effects for i in space.of(e)]
    ends = profiled(problem, model, half, wanted, HALF_WIDTH)
    each = {
        i: _interval(space.slots[i], float(model.fit.theta[i]), *two)
        for i, two in zip(wanted, ends.tolist(), strict=True)
    }
    return {e: {space.slots[i].name: each[i] for i in space.of(e)} for e in effects}


def _interval(slot: Slot, u: float, *ends_u: float) -> Estimate:
    """Turns an interval of the coordinate into one of the parameter."""
    ends = [float(slot.value(np.array(x))) for x in ends_u]
    value = float(slot.value(np.array(u)))
    low, high = min(ends), max(ends)
    if slot.kind == "linear" and slot.low == 0.0:
        low = max(low, 0.0)
    big = 1e9
    return Estimate(min(value, big), min(low, big), min(high, big), slot.unit)
