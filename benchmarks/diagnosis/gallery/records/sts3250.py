"""A Feetech STS3250 with a pendulum of 1.13 kg, no effort: Rhoban BAM, K-Scale."""

import json

import numpy as np

from benchmarks.diagnosis.gallery.models import pendulum_model
from benchmarks.diagnosis.gallery.record import Made, Read, Record
from sysid.drive import JointDrive, Nominal
from sysid.logs.log import MeasuredLog, make_log
from sysid.mechanism import model_mechanism

_NAMES = ("12h23m27", "12h23m42", "12h24m55", "12h27m27")


def _log(read: Read, name: str) -> MeasuredLog:
    path = f"data_raw_feetech/2024-10-26_{name}.json"
    entries = json.loads(read(path))["entries"]
    table = {
        key: np.array([float(entry[key]) for entry in entries])
        for key in ("timestamp", "goal_position", "position", "torque_enable")
    }
    on = table["torque_enable"] > 0.0
    columns = {
        "cmd.servo": np.where(on, table["goal_position"], np.nan),
        "pos.servo": table["position"],
    }
    return make_log(("servo",), table["timestamp"], columns, source=path)


def _made(read: Read) -> Made:
    drive = JointDrive(
        Nominal(20.0, free=True),
        Nominal(0.5, free=True),
        effort="none",
        effects={"armature": {"inertia_kgm2": Nominal(0.01, free=True)}},
    )
    model = pendulum_model("servo", {0.12: 1.13})
    logs = [_log(read, name) for name in _NAMES]
    return logs, model_mechanism(model, {"servo": drive})


RECORD = Record(
    name="sts3250_friction",
    robot="hobby servo STS3250 with 1.13 kg at 0.12 m, positions, 46 to 66 Hz",
    repository="Rhoban/bam",
    commit="b53408c590cb",
    licence="Apache-2.0",
    half="first",
    effects=(
        "coulomb_friction",
        "viscous_friction",
        "stribeck_friction",
        "load_friction",
    ),
    documented="friction of 0.2 N·m, a share of the load and Stribeck parts beside it, "
    "fitted to these records",
    where="params/feetech/m6.json; models: arXiv 2410.08650",
    made=_made,
    remark="Wrong by the rule, and in the servo: its maker gives 0.133 s for 60° "
    "without load, 7.9 rad/s, which the authors' own model has as a limit of the "
    "voltage and not among its parameters. With a record as a fold none predicted "
    "the limit that one record alone meets, and the answer was `unexplained`.",
)
