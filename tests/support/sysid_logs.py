"""Small logs that the tests share."""

import numpy as np

from sysid.logs.log import Load, make_log


def small_log(rows=50, joints=("knee", "hip"), **header):
    """A log of two joints with missing readings, a gap and odd numbers."""
    rng = np.random.default_rng(7)
    t_s = np.cumsum(rng.uniform(0.0019, 0.0021, rows))
    t_s[rows // 2 :] += 0.1
    names = [f"{q}.{j}" for q in ("cmd", "pos", "tau") for j in joints]
    columns = {name: rng.normal(0.0, 0.3, rows) for name in names}
    columns["tau.knee"][3:6] = np.nan
    columns["supply"] = np.full(rows, 1.0 / 3.0)
    header = {"load": Load(0.49, 0.1), "settings": {"kp": 200.0}, **header}
    return make_log(joints, t_s, columns, **header)
