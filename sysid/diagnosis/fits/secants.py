"""How far to go towards a start: as far as the residual, if it were linear, says.

Starts have sizes that matter anywhere. Where readings are exact an effect is found that
is a twentieth of that, and at its start nothing follows it any more.
"""

import numpy as np
from jaxtyping import Float

from sysid.diagnosis.fits.candidate import Model
from sysid.diagnosis.fits.problem import Problem
from sysid.diagnosis.fits.projected import unexplained_by


def along_secants(
    problem: Problem, model: Model, starts: Float[np.ndarray, "c n"]
) -> Float[np.ndarray, "c n"]:
    """Returns θ_0 + a (θ_s − θ_0) with the a that would have the least error.

    Along each line the residual goes from r_0 to r_s as if it were linear, and the
    nuisance parameters follow: a = −d·r_0 / d·d within 0 to 1, of d = r_s − r_0 and r_0
    without what these parameters explain. Nothing is simulated there: the error may be
    another. Of a start that diverges, which has a huge error, a is next to 0; without a
    finite one it is 0.

    Args:
        problem: residuals of a joint.
        model: θ_0, whose nuisance parameters follow.
        starts: coordinates θ_s [1].

    Source:
        Ours; a step of variable projection (see `unexplained_by`) by secants.
    """
    origin = model.fit.theta
    first, *rest = unexplained_by(problem, model, np.stack([origin, *starts]))
    change = np.array(rest) - first
    change[~np.isfinite(change).all(1)] = 0.0
    power = np.maximum(np.sum(change**2, 1), 1e-300)
    share = np.clip(-(change @ first) / power, 0.0, 1.0)
    return origin + share[:, None] * (starts - origin)
