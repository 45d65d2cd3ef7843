"""From where fits to the simulated angle begin: what the equations say, and nominal.

In closed loop the error of the angle has many optima: a servo whose stiffness is off
rings at another frequency, and a fit of the angle stays where it began. The equations
have one optimum and are near the truth, but less exact. And where an error is large,
priors count for nothing: what others can take up of it they do, unless the effect is
fitted alone at first. What has left its tolerance in the smaller model may stand for
the effect: beside it the effect does nothing, or does it twice.
"""

from dataclasses import replace
from functools import partial
from itertools import chain

import numpy as np
from jaxtyping import Float

from sysid.diagnosis.fits.alone import costs, fitted_alone
from sysid.diagnosis.fits.candidate import CONVERGED, Model, fit_models
from sysid.diagnosis.fits.origins import at_nominal, put_back, with_effects
from sysid.diagnosis.fits.projected import linear_costs
from sysid.diagnosis.fits.secants import along_secants
from sysid.diagnosis.fits.starts import (
    FAR_SD,
    best_starts,
    many_optima,
    tried,
)
from sysid.diagnosis.side_by_side import side_by_side
from sysid.diagnosis.simulated.output_error import OutputProblem
from sysid.diagnosis.simulated.play import NAME as PLAY
from sysid.diagnosis.simulated.torque_scales import at_every_scale

EQUATIONS_TRIED = 3
"""Number of candidates of a stage that are fitted to the angle as the equations say."""

ALONE_TRIED = 3
"""The same of those that come nearest to it when they are fitted alone: at nominal, in
the smaller model, and there with what has left its tolerance put back, each; and there
of the size that a secant says, if the nuisance parameters follow."""

NEARER = 1e-6
"""Share of the smaller model's error by which a start of a secant's size is nearer."""

MUCH = 2.0
"""Mean squared error of the smaller model, in units of its noise, that is worth fits of
a play from every size."""


def output_starts(
    problem: OutputProblem, smaller: Model, proposed: list[Model]
) -> list[tuple[tuple[str, ...], Float[np.ndarray, " n"]]]:
    """Returns where fits of the likeliest models begin: from two places each, and more.

    One is near: the effect fitted alone beside the smaller model, or all as in the
    equations, whichever errs less. The other begins at nominal, with the effect fitted
    alone: without an effort all torques together may grow, and in that valley the near
    one may have gone far. Those are chosen that come nearest if they are fitted alone
    there, those that do in the smaller model, and some that the equations prefer. Where
    a nominal parameter of the smaller model stands for an effect, as the servo's
    damping for viscous friction, all effects come alike near there; at nominal they do
    not. But there the gains' own tolerances may matter more than any effect, so those
    begin too that come nearest where it alone is put back. And those begin that come
    nearest if the nuisance parameters follow: alone beside those that have taken up a
    part of it, as gains take up play, an effect shrinks to nothing. A joint crosses a
    large play freely: hills lie between its sizes, and beside gains that stand for it
    the nearest size may be none, so where much is left it is fitted from each. And
    where no gain is known, beside gains of several sizes (`torque_scales`).

    Args:
        problem: the error of the angle.
        smaller: the model that lacks an effect, fitted to the angle.
        proposed: models of the equations, each with one effect more, best first.
    """
    own = _own_starts(problem, smaller, proposed, smaller.fit.theta)
    ways = (
        partial(_near_and_nominal, own=own),
        _followed,
        _of_every_size,
        lambda one, base, more: at_every_scale(one, base, more, ALONE_TRIED),
        _with_others_back,
    )
    apart = [replace(problem, seen=problem.seen.apart()) for _ in ways]
    found = side_by_side(
        [
            partial(way, one, smaller, proposed)
            for way, one in zip(ways, apart, strict=True)
        ]
    )
    problem.seen.join([p.seen for p in apart])
    return list(chain.from_iterable(found))


def _near_and_nominal(
    problem: OutputProblem,
    smaller: Model,
    proposed: list[Model],
    own: dict[str, list],
) -> list[tuple[tuple[str, ...], Float[np.ndarray, " n"]]]:
    """Returns the two places of those that come nearest there, fitted alone."""
    sets = [m.effects for m in proposed]
    begin = [at_nominal(problem, m) for m in proposed]
    beside = _beside(problem, proposed, smaller.fit.theta, own)
    fits = fitted_alone(problem, [*sets, *sets], [*begin, *beside])
    alone, added = fits[: len(sets)], fits[len(sets) :]
    fitted = [m.fit.theta for m in proposed]
    closer = costs(problem, sets, added) <= costs(problem, sets, fitted)
    near = np.where(closer[:, None], added, fitted)
    chosen = dict.fromkeys(range(min(EQUATIONS_TRIED, len(sets))))
    for thetas in (alone, added):
        ranked = np.argsort(costs(problem, sets, thetas))
        chosen |= dict.fromkeys(ranked[:ALONE_TRIED].tolist())
    return [(sets[k], start) for k in chosen for start in (near[k], alone[k])]


def _of_every_size(
    problem: OutputProblem, smaller: Model, proposed: list[Model]
) -> list[tuple[tuple[str, ...], Float[np.ndarray, " n"]]]:
    """Returns the nearest play fitted beside the smaller model, if much is left."""
    sets = [m.effects for m in proposed if m.effects[-1] == PLAY]
    if not sets or smaller.errors.max() <= MUCH:
        return []
    begin = tried(problem, smaller, smaller.fit.theta, PLAY)
    # On its way through a narrow valley, rounding is enough to lead out of it: again.
    for _ in range(2):
        each = sets * len(begin)
        (ended,) = fit_models(problem, each, begin, rounds=CONVERGED, nearest=True)
        begin = [ended.fit.theta]
    return [(sets[0], ended.fit.theta)]


def _followed(
    problem: OutputProblem, smaller: Model, proposed: list[Model]
) -> list[tuple[tuple[str, ...], Float[np.ndarray, " n"]]]:
    """Returns the nearest of what secants say, where the nuisance parameters follow.

    What is one of these parameters itself follows, and what comes no nearer than the
    smaller model leads away from the records: both are no starts.
    """
    begin = [
        (m.effects, theta)
        for m in proposed
        for e in m.effects[-1:]
        if not (many_optima(problem, e) or problem.space.has_nominal(e))
        for theta in tried(problem, smaller, smaller.fit.theta, e)
    ]
    if not begin:
        return []
    starts = along_secants(problem, smaller, np.stack([u for _, u in begin]))
    thetas = np.stack([smaller.fit.theta, *starts])
    rest, *left = linear_costs(problem, smaller, thetas)
    nearest: dict[tuple[str, ...], Float[np.ndarray, " n"]] = {}
    for k in np.argsort(left).tolist():
        if left[k] < (1.0 - NEARER) * rest:
            nearest.setdefault(begin[k][0], starts[k])
    return list(nearest.items())[:ALONE_TRIED]


def _own_starts(
    problem: OutputProblem,
    smaller: Model,
    proposed: list[Model],
    origin: Float[np.ndarray, " n"],
) -> dict[str, list]:
    """Returns the best own starts of the last effects, all else as at an origin."""
    names = [m.effects[-1] for m in proposed]
    smooth = [name for name in names if not many_optima(problem, name)]
    return best_starts(problem, smaller, origin, smooth)


def _with_others_back(
    problem: OutputProblem, smaller: Model, proposed: list[Model]
) -> list[tuple[tuple[str, ...], Float[np.ndarray, " n"]]]:
    """Returns those that come nearest where what has left its tolerance is put back."""
    origin = put_back(problem, smaller, FAR_SD)
    if np.array_equal(origin, smaller.fit.theta):
        return []
    sets = [m.effects for m in proposed]
    own = _own_starts(problem, smaller, proposed, origin)
    fits = fitted_alone(problem, sets, _beside(problem, proposed, origin, own))
    ranked = np.argsort(costs(problem, sets, fits))[:ALONE_TRIED]
    return [(sets[k], fits[k]) for k in ranked.tolist()]


def _beside(
    problem: OutputProblem,
    proposed: list[Model],
    origin: Float[np.ndarray, " n"],
    own: dict[str, list],
) -> list[Float[np.ndarray, " n"]]:
    """Returns an origin, each time with the last effect of another larger model.

    Its size is that of the equations, or one of the effect's own starts if the angle is
    nearer with it; equations may be wrong by so much that a limit is not met, or is one
    of the other direction, and from there no slope leads back.
    """
    names = [m.effects[-1] for m in proposed]
    said = [with_effects(problem, origin, m, m.effects[-1:]) for m in proposed]
    begun = [own.get(name, [u])[0] for name, u in zip(names, said, strict=True)]
    sets, rest = [m.effects for m in proposed], [origin] * len(names)
    first, second, idle = (costs(problem, sets, x) for x in (said, begun, rest))
    still = np.isclose(first, idle, rtol=1e-6, atol=0.0)
    return list(np.where((still | (second < first))[:, None], begun, said))
