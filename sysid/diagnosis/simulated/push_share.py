"""How much of what pushes may err by a record shows: components of variance.

What may be lost of a push, as it is sampled and read, is a bound: where a neighbour
moves smoothly it is many times what is lost, and all of an angle's error would drown in
it. Such a bound is right up to a factor, and the error of the angle shows the factor:
it must be larger where more may be lost.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from sysid.diagnosis.simulated.output_error import OutputProblem

SHARES = np.concatenate([[0.0], np.geomspace(0.003, 1.0, 20)])
"""Factors among which the likeliest are taken [1]."""


def shown_pushes(
    problem: OutputProblem, raw: Float[np.ndarray, "2 m p"]
) -> OutputProblem:
    """Takes what is lost of pushes to be as large as the error of the angle shows.

        c = argmax_{0 ≤ c_k ≤ 1} Σ_t log N(r_t; 0, s² + u_t² + Σ_k c_k² p_kt²)

    with the uncertainties p_k of the angle by pushes as they are sampled and as they
    are read, and u by all else. Repeats differ by what is lost of either: of them the
    differences are taken, with the mean of both squares. Without repeats what a model
    errs by is in r, too, and makes c larger.

    Args:
        problem: the error of the angle.
        raw: errors of one candidate, without weights [rad].

    Returns:
        The problem with those shares; its noise is that of before.

    Source:
        Maximum likelihood of components of variance: H. O. Hartley, J. N. K. Rao,
        Maximum-Likelihood Estimation for the Mixed Analysis of Variance Model,
        Biometrika 54, 1967; with the noise s as it is estimated anyway.
    """
    problem = replace(problem, push_shares=(1.0, 1.0))
    squares, error, valid = problem.unsure() ** 2, raw[1], problem.valid[1]
    if not np.any(squares[2:, valid]):
        return problem
    if problem.repeat:
        error, valid = problem.repeat.differences(error, valid)
        if not valid.any():
            return problem
        squares = np.stack([_of_both(problem, x) for x in squares])
    known = problem.noise_of(raw) ** 2 + squares[:2, valid].sum(0)
    pairs = np.stack(np.meshgrid(SHARES, SHARES), -1).reshape(-1, 2)
    lost = [_unlikely(error[valid], known + c**2 @ squares[2:, valid]) for c in pairs]
    sampled, read = pairs[int(np.argmin(lost))].tolist()
    return replace(problem, push_shares=(sampled, read))


def _unlikely(r: Float[np.ndarray, " n"], variance: Float[np.ndarray, " n"]) -> float:
    """Returns −2 log N(r; 0, variance), up to a constant."""
    return float(np.sum(np.log(variance) + r**2 / variance))


def _of_both(
    problem: OutputProblem, square: Float[np.ndarray, "m p"]
) -> Float[np.ndarray, "m p"]:
    """Returns the mean of squares at a sample and at its twin."""
    apart = problem.repeat.differences(square, problem.valid[1])[0] / np.sqrt(2.0)
    return np.maximum(square - apart, 0.0)
