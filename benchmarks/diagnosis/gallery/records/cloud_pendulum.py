"""A pendulum of two links on direct drives, from the course cloudpendulum/dp_sysid.

Masses and lengths are the provisional ones of the course's notebook, whose links are
points. Its gains are not those of the record, whose torques follow 0.40 N·m/rad and
0.004 N·m·s/rad instead of 0.14 and 0.002: the controller is left aside.
"""

import io

import numpy as np

from benchmarks.diagnosis.gallery.chain import Link, chain_model, shifted
from benchmarks.diagnosis.gallery.models import DRIVEN, driven_columns
from benchmarks.diagnosis.gallery.record import Made, Read, Record
from sysid.logs.log import make_log
from sysid.mechanism import model_mechanism

_JOINTS = ("shoulder", "elbow")
_LENGTH_M = 0.05
_PARTS = ((0.131, 0.046), (0.064, 0.048))
"""Mass [kg] of a link and its distance from the axis [m]."""

_ROTOR_KGM2 = 61e-6
"""`Ir` of the notebook's `fixed_mpar`."""

_POINT = 1e-9 * np.eye(3)


def _made(read: Read) -> Made:
    path = "data/sysid_exp_data_30s.csv"
    table = np.genfromtxt(io.BytesIO(read(path)), delimiter=",", names=True)
    angles, torques = ([table[f"{x}_meas{k}"] for k in (1, 2)] for x in ("pos", "tau"))
    columns = driven_columns(_JOINTS, angles, torques)
    links = {}
    for k, (joint, (mass, arm)) in enumerate(zip(_JOINTS, _PARTS, strict=True)):
        links[joint] = Link(
            shifted((0.0, 0.0, -k * _LENGTH_M)),
            mass,
            np.array([0.0, 0.0, -arm]),
            _POINT,
            axis=(0.0, 1.0, 0.0),
            armature=_ROTOR_KGM2,
        )
    log = make_log(_JOINTS, table["time"], columns, source=path)
    return [log], model_mechanism(chain_model(links), dict.fromkeys(_JOINTS, DRIVEN))


RECORD = Record(
    name="cloud_pendulum",
    robot="pendulum of two links of 0.13 and 0.06 kg on direct drives, torques, 300 Hz",
    repository="cloudpendulum/dp_sysid",
    commit="93466dc4a02a",
    licence="BSD-3-Clause",
    half="second",
    effects=("coulomb_friction", "viscous_friction"),
    documented="viscous and Coulomb friction in both joints; a course has its students "
    "find their sizes",
    where="system_identification_student.ipynb, sections 1 and 2",
    made=_made,
    remark="Open: `unexplained`, nearest hysteresis in the elbow. It is dry friction"
    " that builds up over 6 mrad, of 3 mN·m. What remains was expected: the gains "
    "that the record follows are not those that are documented, and the masses weigh "
    "0.06 kg.",
)
