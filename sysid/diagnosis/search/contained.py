"""An effect that contains another takes its place only if the angle shows the more.

What a simulation errs by, an equation takes for the shape that a further figure gives:
of large dry friction, that it falls with speed. The judge is the simulated angle.
"""

from collections.abc import Sequence

from sysid.diagnosis.fits.candidate import Model
from sysid.diagnosis.search.judge import Judge
from sysid.diagnosis.search.stage import NESTED


def shows_more(judge: Judge, plain: Model, model: Model) -> bool:
    """Whether the angle lets an effect take the place of one that it contains.

    Args:
        judge: of the search.
        plain: a model.
        model: the same with another effect in the place of one.

    Returns:
        True, too, where that other contains nothing, and where the angle is all that
        was fitted.

    Source:
        Ours; `Judge.shows`.
    """
    contained, other = (
        [e for e in one.effects if e not in two.effects]
        for one, two in ((plain, model), (model, plain))
    )
    nested = {e for effect in contained for e in NESTED.get(effect, ())}
    if not nested.intersection(other):
        return True
    return judge.output is judge.problem or judge.shows(plain, model)


def plainest(
    judge: Judge, smaller: Model, model: Model, others: Sequence[Model]
) -> Model:
    """Returns an effect that a confirmed one contains, where it is all that is shown.

    Args:
        judge: of the search.
        smaller: the model without either.
        model: with the effect that the judge confirmed.
        others: candidates, best first; such an effect must be confirmed, too.
    """
    for plain in others:
        if not shows_more(judge, plain, model) and judge.confirms(smaller, plain):
            return plain
    return model
