"""One joint of an AM-D02 arm on a slow serial line."""

import io

import numpy as np

from benchmarks.diagnosis.gallery.models import DRIVEN, driven_columns, urdf_model
from benchmarks.diagnosis.gallery.record import Made, Read, Record
from sysid.logs.log import make_log
from sysid.mechanism import model_mechanism

_JOINT, _PLACE = "ArmLfourth_Joint", 2


def _made(read: Read) -> Made:
    path = "results/real_uart_capture_collect_joint_3.npz"
    table = np.load(io.BytesIO(read(path)), allow_pickle=False)
    angle, torque = (table[name][:, _PLACE] for name in ("q", "tau_measured"))
    columns = driven_columns((_JOINT,), [angle], [torque])
    log = make_log((_JOINT,), table["time"], columns, source=path)
    model = urdf_model(read("am_d02_model/urdf/AM-D02-AemLURDF0413.urdf"))
    return [log], model_mechanism(model, {_JOINT: DRIVEN})


RECORD = Record(
    name="amd02_friction",
    robot="third joint of an arm AM-D02, angle and torque, 32 Hz",
    repository="YIZHIXIAOCANGSHU/Friction-Identification-for-Manipulators",
    commit="f915751262ab",
    licence="none",
    half="first",
    effects=("coulomb_friction", "viscous_friction"),
    documented="Coulomb friction of 0.34 N·m and viscous friction of 0.27 N·m·s/rad",
    where="results/real_friction_identification_summary.json, third entry",
    made=_made,
    remark="Open. Rows are 31 ms apart; further apart than 30 ms only the rests "
    "between motions count, and of a joint that an effort drives rests show "
    "nothing.",
)
