"""Maximum a-posteriori fits of many candidates side by side, and standard errors."""

from sysid.least_squares.fits import Fit, Task, fit_all
from sysid.least_squares.sandwich import block_sandwich, standard_errors

__all__ = [
    "Fit",
    "Task",
    "block_sandwich",
    "fit_all",
    "standard_errors",
]
