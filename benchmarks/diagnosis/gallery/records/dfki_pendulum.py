"""A pendulum on a quasi-direct drive, swung up by torques: DFKI, Bremen."""

import io

import numpy as np

from benchmarks.diagnosis.gallery.models import DRIVEN, driven_columns, pendulum_model
from benchmarks.diagnosis.gallery.record import Made, Read, Record
from sysid.logs.log import make_log
from sysid.mechanism import model_mechanism

_ROTOR_KGM2 = 0.000060719 * 6.0**2
"""Rotor's inertia behind a gear of 6:1 (hardware/testbench_description.md)."""


def _made(read: Read) -> Made:
    logs = []
    for part in ("control_method_ddp", "control_method_direct_collocation"):
        path = f"results/{part}/data_measured.csv"
        table = np.genfromtxt(io.BytesIO(read(path)), delimiter=",", names=True)
        columns = driven_columns(("pendulum",), [table["position"]], [table["torque"]])
        logs.append(make_log(("pendulum",), table["time"], columns, source=path))
    model = pendulum_model("pendulum", {0.5: 0.546, 0.25: 0.13}, _ROTOR_KGM2)
    return logs, model_mechanism(model, {"pendulum": DRIVEN})


RECORD = Record(
    name="dfki_pendulum",
    robot="pendulum of 0.68 kg on a T-Motor AK80-6, torques, 330 to 500 Hz",
    repository="dfki-ric-underactuated-lab/torque_limited_simple_pendulum",
    commit="ed17ea2d32a3",
    licence="BSD-3-Clause",
    half="first",
    effects=("coulomb_friction", "viscous_friction"),
    documented="Coulomb friction of 0.18 N·m and viscous friction of 0.047 N·m·s/rad, "
    "identified from another record of the same bench",
    where="results/control_method_pd/system_identification/system_identification.txt",
    made=_made,
    remark="Right by the rule, and barely: some dry friction of 0.2 N·m, as the "
    "authors have, by 14 nat, and which kind stays open. The shifted load beside it, "
    "of 13 nat, is documented by nobody, and that there is no effect has 31 %: the "
    "torque of these records is that of 10 s, and 0.2 N·m of it is noise. The answer "
    "before was not_observable.",
)
