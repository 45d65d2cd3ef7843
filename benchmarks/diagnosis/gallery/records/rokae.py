"""A Rokae AR5 arm of seven joints, measured torques."""

import io

import numpy as np

from benchmarks.diagnosis.gallery.models import DRIVEN, driven_columns, urdf_model
from benchmarks.diagnosis.gallery.record import Made, Read, Record
from sysid.logs.log import make_log
from sysid.mechanism import model_mechanism

_JOINTS = tuple(f"AR5-5_07R-W4C4A2_joint_{k}" for k in range(1, 8))

_BASE_QUAT_W = (0.5**0.5, 0.0, 0.5**0.5, 0.0)
"""The base is mounted sideways (step2_dynamics_parameter_estimation.py, `R_base`)."""


def _made(read: Read) -> Made:
    path = "src/config/dynamics_identification_data_real.csv"
    table = np.genfromtxt(io.BytesIO(read(path)), delimiter=",", names=True)
    angles, torques = ([table[f"{x}{k}"] for k in range(7)] for x in ("q", "tau"))
    columns = driven_columns(_JOINTS, angles, torques)
    log = make_log(
        _JOINTS, table["time"], columns, source=path, palm_quat_w=_BASE_QUAT_W
    )
    model = urdf_model(read("urdf/AR5-5_07R-W4C4A2.urdf"))
    return [log], model_mechanism(model, dict.fromkeys(_JOINTS, DRIVEN))


RECORD = Record(
    name="rokae_friction",
    robot="arm Rokae AR5, seven joints, angles and torques, 50 Hz",
    repository="FrankJIE09/Dynamics_identification_Frank",
    commit="758dc8d6f78e",
    licence="none",
    half="first",
    effects=("coulomb_friction", "viscous_friction"),
    documented="Coulomb friction of 0.1 to 0.43 N·m in every joint, viscous "
    "friction of up to 0.58 N·m·s/rad in four",
    where="scripts/data_output/dynamics_parameters_friction.csv",
    made=_made,
    remark="Right by the rule, for joint 1 alone, where its probability is 49 % and "
    "that of no effect 43 %: Coulomb friction of 0.41 N·m; the authors have 0.1"
    " to 0.43 in every joint. In joints 3, 5, 6 and 7 dry friction is found of "
    "the size that they give (0.30, 0.17, 0.19, 0.06 N·m), but as Dahl's, which"
    " needs 0.3 to 5 mrad to build up, or as one that depends on the direction."
    " Joints turn by a tenth of those milliradians between two rows when they "
    "reverse, so the records do show it; Coulomb friction alone gains half as "
    "much. The answer before named none in joint 1 and was wrong.",
)
