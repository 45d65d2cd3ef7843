"""A pendulum of two links on quasi-direct drives, design C.1: DFKI, Bremen.

Masses, lengths, inertias and rotors are those that the authors identified, without the
friction that stands beside them.
"""

import io
from typing import Any

import numpy as np
import yaml

from benchmarks.diagnosis.gallery.chain import Link, chain_model, shifted
from benchmarks.diagnosis.gallery.models import DRIVEN, driven_columns
from benchmarks.diagnosis.gallery.record import Made, Read, Record
from sysid.logs.log import MeasuredLog, make_log
from sysid.mechanism import model_mechanism

_JOINTS = ("shoulder", "elbow")
_FOLDER = "data/experiment_records/design_C.1/sys_id/20230629"
_MODEL = "data/system_identification/identified_parameters/design_C.1/model_1.0"

_TIMES = (
    *("143339", "143524", "143601", "143704", "143747"),
    *("143906", "144003", "144115", "154220", "154548"),
)
"""Of the day's records those of six and ten seconds."""


def _log(read: Read, time: str) -> MeasuredLog:
    path = f"{_FOLDER}/20230629-{time}/trajectory.csv"
    table = np.genfromtxt(io.BytesIO(read(path)), delimiter=",", names=True)
    angles, torques = ([table[f"{x}_meas{k}"] for k in (1, 2)] for x in ("pos", "tau"))
    columns = driven_columns(_JOINTS, angles, torques)
    return make_log(_JOINTS, table["time"], columns, source=path)


def _link(known: dict[str, float], number: int) -> Link:
    """One link; the file has its inertia about the axis."""
    mass, arm = known[f"m{number}"], known[f"r{number}"]
    return Link(
        shifted((0.0, 0.0, -known["l1"] if number == 2 else 0.0)),
        mass,
        np.array([0.0, 0.0, -arm]),
        (known[f"I{number}"] - mass * arm**2) * np.eye(3),
        axis=(0.0, 1.0, 0.0),
        armature=known["Ir"] * known["gr"] ** 2,
    )


def _model(read: Read) -> Any:
    known = yaml.safe_load(read(f"{_MODEL}/model_parameters.yml"))
    return chain_model({j: _link(known, k) for k, j in enumerate(_JOINTS, 1)})


def _made(read: Read) -> Made:
    logs = [_log(read, time) for time in _TIMES]
    return logs, model_mechanism(_model(read), dict.fromkeys(_JOINTS, DRIVEN))


RECORD = Record(
    name="dfki_double_pendulum",
    robot="pendulum of two links of 0.52 and 0.63 kg on T-Motor AK80-6, torques, "
    "500 Hz",
    repository="dfki-ric-underactuated-lab/double_pendulum",
    commit="1e8544e67f3d",
    licence="BSD-3-Clause",
    half="second",
    effects=("coulomb_friction",),
    documented="Coulomb friction of 0.16 and 0.12 N·m times arctan(100 q̇), so up to "
    "0.25 and 0.19 N·m; viscous friction is at its lower bound",
    where=f"{_MODEL}/model_parameters.yml; "
    "src/python/double_pendulum/model/symbolic_plant.py",
    made=_made,
    remark="Right: Coulomb friction in both joints, 0.21 N·m (0.14 to 0.27), where "
    "the authors' smooth law comes to 0.16 to 0.25 and 0.12 to 0.19, and nothing "
    "else. In five of the records one motor is off, and half of the files are absent "
    "from the copy that was read.",
)
