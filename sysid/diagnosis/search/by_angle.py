"""The angle is searched itself where the equations' answer leaves some of it.

A logged effort that jumps with its targets is noisy, and a spring or a limit that the
equations then do not show moves the angle by many times its noise. A search by the
error of the angle, as where no effort was logged, may do better, and counts if it
leaves next to nothing, and as much less than the first answer as a cause has to.
"""

from sysid.diagnosis.fits.candidate import Model
from sysid.diagnosis.search.judge import LEAST_FALL, Judge
from sysid.diagnosis.search.remains import leaves_much
from sysid.diagnosis.simulated.output_error import OutputProblem

FAR_LESS = 0.25
"""Least share of an angle's error that goes with a cause in the joint beside it."""

SEARCHED = 1.3
"""Mean squared error of the angle, in units of its noise, that is searched. Of 31
joints without an effect, with repeats, at most 1.24 is left; to say that it is
unexplained takes more (`LEFT`)."""

SEARCHED_ALONE = 1.0
"""The same without repeats: the noise is taken too large then, up to twice its square,
and an effect may hide in that."""


def nearest(judge: Judge, model: Model) -> Model:
    """Returns the nearer fit to the angle: with all free, or with the effort's gains.

    Gains that are hardly known may lead the first into a valley of their own.
    """
    fits = (judge.moved(model), judge.serving(model).moved(model))
    return min(fits, key=lambda m: float(m.errors.sum()))


def explains(before: float, after: float) -> bool:
    """Whether causes leave little of an error, and far less than was there.

    Args:
        before: mean squared error of the nominal model, in units of its noise [1].
        after: the same with the causes [1].
    """
    fall = 1.0 - (after / before) ** 0.5
    return fall > FAR_LESS and not leaves_much(before, after)


def explained(base: Model, best: Model, first: Model) -> bool:
    """Whether the answer of such a search explains what the first answer did not.

    Args:
        base: the nominal model, fitted to the angle.
        best: the answer of the search.
        first: the answer of the equations, fitted to the angle.
    """
    if not best.effects or leaves_much(base.errors[1], best.errors[1]):
        return False
    return 1.0 - (best.errors[1] / first.errors[1]) ** 0.5 > LEAST_FALL


def unsolved(
    judge: Judge, base: Model, best: Model, stage: list[Model]
) -> tuple[OutputProblem, Model] | None:
    """Returns from where the angle is searched; None where there is no need.

    Args:
        judge: of the search by equations.
        base: its nominal model.
        best: its answer.
        stage: what it tried beside the nominal model alone, if its answer is none.
    """
    output = judge.output
    if output is judge.problem or not isinstance(output, OutputProblem):
        return None
    # Without repeats its noise is what neighbouring readings do not share.
    least = SEARCHED if output.repeat else SEARCHED_ALONE
    before, after = nearest(judge, base), nearest(judge, best)
    if not leaves_much(before.errors[1], after.errors[1], least):
        return None
    if not best.effects:
        output.stages.setdefault((), stage)
    return output, judge.moved(base)
