"""Logs of one joint as lines of three numbers: time [s], target [rad], angle [rad]."""

from pathlib import Path

import numpy as np

from envs.errors import InputError
from sysid.logs.log import MeasuredLog, make_log


def read_rec(path: Path) -> MeasuredLog:
    """Reads such a file.

    Raises:
        InputError: other lines.
    """
    try:
        t_s, cmd, pos = np.loadtxt(path, ndmin=2).T
    except ValueError as error:
        raise InputError(path, "", error, "lines of three numbers") from error
    columns = {"cmd.knee": cmd, "pos.knee": pos}
    return make_log(("knee",), t_s, columns, source=str(path))
