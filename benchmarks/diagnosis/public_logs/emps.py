"""The electro-mechanical positioning system: a linear axis with friction, 1 kHz.

Source:
    Janot, Gautier, Brunot, "Data Set and Reference Models of EMPS", Workshop on
    Nonlinear System Identification Benchmarks, Eindhoven 2019,
    www.nonlinearbenchmark.org
"""

from pathlib import Path

import numpy as np
import scipy.io

from envs.errors import InputError
from sysid.logs.log import MeasuredLog, make_log

FILES = ("DATA_EMPS.mat", "DATA_EMPS_PULSES.mat")
_NEEDED = ("t", "qm", "qg", "vir", "gtau", "kp", "kv")


def load_emps(folder: str | Path) -> tuple[MeasuredLog, MeasuredLog]:
    """Loads both records: for fitting, and with force pulses for validation.

    One joint `axis` in metres; `tau` is the motor's force, gtau · controller voltage.
    The second record has the pulses of its `pulses_N` as `ext`; what they are in
    newtons at the carriage is not documented, so their gain is to be fitted.

    Raises:
        InputError: a file is missing or is not one of this data set.
    """
    first, second = (_load(Path(folder) / name) for name in FILES)
    return first, second


def _load(path: Path) -> MeasuredLog:
    """Loads one record."""
    data = _read(path)
    t_s, force = data["t"], data["gtau"] * data["vir"]
    columns = {"cmd.axis": data["qg"], "pos.axis": data["qm"], "tau.axis": force}
    units = {"cmd": "m", "pos": "m", "tau": "N"}
    if "pulses_N" in data:
        columns["ext.axis"], units["ext"] = data["pulses_N"], "N"
    settings = {name: float(data[name][0]) for name in ("gtau", "kp", "kv")}
    return make_log(("axis",), t_s, columns, units, settings=settings, source=str(path))


def _read(path: Path) -> dict[str, np.ndarray]:
    """Reads a MATLAB file into flat arrays."""
    valid = "a file of the EMPS data set with " + ", ".join(_NEEDED)
    try:
        data = scipy.io.loadmat(path, appendmat=False)
    except Exception as error:  # SciPy's parser fails in any way on a broken file
        raise InputError(path, "", error, valid) from error
    arrays = {k: v for k, v in data.items() if not k.startswith("__")}
    missing = [name for name in _NEEDED if name not in arrays]
    if missing:
        raise InputError(path, "", f"no {', '.join(missing)}", valid)
    try:
        return {k: np.asarray(v, dtype=float).ravel() for k, v in arrays.items()}
    except (TypeError, ValueError) as error:
        raise InputError(path, "", error, valid) from error
