"""Maximum a-posteriori fits of many candidates side by side, and standard errors."""

from sysid.least_squares.fits import (
    Fit,
    Task,
    block_sandwich,
    fit_all,
    standard_errors,
)

__all__ = [
    "Fit",
    "Task",
    "block_sandwich",
    "fit_all",
    "standard_errors",
]
