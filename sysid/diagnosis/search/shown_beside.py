"""A scale of an encoder that its own joint shows, but hardly minds.

The servo follows what the encoder reads, so a joint whose encoder counts too much moves
nearly as ever, by its own reading. But it hangs elsewhere than it is read, and the
joints that it carries, or that carry it, lack the weight of that: what goes of their
error, goes with its cause.
"""

from dataclasses import replace

import numpy as np

from sysid.diagnosis.fits.candidate import Model
from sysid.diagnosis.search.by_angle import explains, leaves_much, nearest
from sysid.diagnosis.search.search import Search
from sysid.diagnosis.search.selection import accepted
from sysid.diagnosis.simulated.output_error import OutputProblem

EFFECT = "encoder_scale"
"""Of what changes readings it alone changes the motion of others and not its own."""


def suspected(found: Search) -> Model | None:
    """Returns the scale of an encoder, if that is first and only too small a share.

    Args:
        found: the search of a joint.
    """
    if found.best.effects or not found.rejected:
        return None
    first = found.rejected[0]
    problem, base = found.problem, found.base
    if first.effects != (EFFECT,) or not accepted(problem, base, first, base):
        return None
    return first if found.judge.prefers(base, first) else None


def unsolved_beside(found: Search) -> bool:
    """Whether much is left of a joint's angle, of which something beside it may be why.

    Args:
        found: the search of that joint.
    """
    if not isinstance(found.judge.output, OutputProblem):
        return False
    before, after = (nearest(found.judge, m) for m in (found.base, found.best))
    return leaves_much(before.errors[1], after.errors[1])


def solved(before: Search, again: Search) -> bool:
    """Whether a joint's motion is explained beside another one that stands elsewhere.

    With no more causes of its own, and by as much as a cause of its own would have to.

    Args:
        before: its search beside the other one as it was read.
        again: the same beside the other one as it stands.
    """
    if not set(again.best.effects) <= set(before.best.effects):
        return False
    rest = nearest(again.judge, again.best).errors[1]
    return explains(rest * left(before) / max(left(again), 1e-300), rest)


def left(found: Search) -> float:
    """What a joint's best model leaves of its angle, Σ r², or of its equations.

    Args:
        found: its search; where the angle can be simulated, one may be by it, and one
            not.

    Source:
        Ours.
    """
    best = nearest(found.judge, found.best)
    raw = found.judge.output.raw(best.fit.theta[None], weigh=False)
    return float(np.sum(raw**2))


def with_cause(found: Search, model: Model) -> Search:
    """Returns a search whose answer is one of the candidates of its last stage."""
    others = [m for m in found.rejected if m is not model]
    (effect,) = model.effects
    return replace(
        found,
        best=model,
        alternatives={effect: others},
        without={effect: found.base},
        rejected=[],
    )
