"""The model that lacks an effect, fitted to the simulated angle; the noise there."""

import numpy as np

from sysid.diagnosis.fits.candidate import CONVERGED, Model, fit_models
from sysid.diagnosis.fits.clock import without_drift
from sysid.diagnosis.fits.origins import at_nominal, near_nominal
from sysid.diagnosis.simulated.output_error import OutputProblem
from sysid.diagnosis.simulated.push_share import shown_pushes


def settled_output(
    output: OutputProblem, equations: Model
) -> tuple[OutputProblem, Model]:
    """Fits the nuisance parameters to the angle and estimates the noise, in turns.

    Args:
        output: the error of the angle, of unit noise.
        equations: a model by the equations.

    Returns:
        The problem with its noise, and the model of the same effects.
    """
    effects = equations.effects
    fitted = equations.fit.theta
    begin = at_nominal(output, equations), near_nominal(output, equations)
    starts = np.stack([*begin, fitted])
    raw = output.raw(starts, weigh=False)
    nearest = starts[np.argmin(np.sum(raw**2, (1, 2, 3)))]
    problem = _with_noise(output, nearest)
    sets, begin = [effects] * len(starts), list(starts)
    (model,) = fit_models(problem, sets, begin, rounds=CONVERGED, nearest=True)
    theta = model.fit.theta
    problem = _with_noise(output, theta)
    return problem, fit_models(problem, [effects], [theta], rounds=CONVERGED)[0]


def _with_noise(output: OutputProblem, theta: np.ndarray) -> OutputProblem:
    """Estimates the noise of what a model leaves, with what it shows of pushes."""
    raw = without_drift(output, theta)
    return shown_pushes(output, raw).with_noise(raw)
