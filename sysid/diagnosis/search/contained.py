"""An effect that contains another takes its place only if more than that is shown.

What a simulation errs by, an equation takes for the shape that a further figure gives:
of large dry friction, that it falls with speed. The judge is the simulated angle, or an
effort that only the larger effect explains.
"""

from collections.abc import Sequence

from sysid.diagnosis.fits.candidate import Model
from sysid.diagnosis.search.judge import Judge
from sysid.diagnosis.search.stage import NESTED


def shows_more(judge: Judge, plain: Model, model: Model) -> bool:
    """Whether another effect may stand in the place of one.

    Args:
        judge: of the search.
        plain: a model.
        model: the same with another effect in the place of one.

    Returns:
        False where the other contains that one, and neither angle nor effort shows
        more. True where the joint cannot be simulated apart from what was fitted.

    Source:
        Ours; `Judge.shows`, `Judge.explains`.
    """
    contained, other = (
        [e for e in one.effects if e not in two.effects]
        for one, two in ((plain, model), (model, plain))
    )
    nested = {e for effect in contained for e in NESTED.get(effect, ())}
    if not nested.intersection(other) or judge.output is judge.problem:
        return True
    return judge.explains(plain, model) or judge.shows(plain, model)


def plainer(
    judge: Judge, smaller: Model, model: Model, others: Sequence[Model]
) -> Model | None:
    """Returns a confirmed model of what an effect contains, if no more is shown.

    Args:
        judge: of the search.
        smaller: the model without the effect.
        model: with it.
        others: with others in its place, best first.
    """
    for plain in others:
        if not shows_more(judge, plain, model) and judge.confirms(smaller, plain):
            return plain
    return None
