"""Maximum a-posteriori fits of many candidates side by side, and standard errors."""

from sysid.least_squares.fits import (
    Fit,
    Task,
    block_sandwich,
    fit_all,
    standard_errors,
)
from sysid.least_squares.newton import bounded_step, gauss_newton, normal_equations

__all__ = [
    "Fit",
    "Task",
    "block_sandwich",
    "bounded_step",
    "fit_all",
    "gauss_newton",
    "normal_equations",
    "standard_errors",
]
