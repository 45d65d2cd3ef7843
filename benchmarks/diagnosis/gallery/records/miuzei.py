"""A Miuzei servo of 25 kgf·cm with an arm, positions alone."""

import json

import numpy as np

from benchmarks.diagnosis.gallery.record import Made, Read, Record
from envs.physics.quiet_mujoco import mujoco
from sysid.drive import JointDrive, Nominal
from sysid.logs.log import MeasuredLog, make_log
from sysid.mechanism import model_mechanism

_FOLDER = "src/sysid/desc"
_ROW_S = 0.02
_LEAST_ROWS = 100
"""Rows below which a rollout is over before its start is forgotten."""


def _log(rollout: dict, number: int) -> MeasuredLog:
    cmd, pos = (np.pi * np.array(rollout[k]) for k in ("actions", "sensor_data"))
    columns = {"cmd.servo": cmd, "pos.servo": pos}
    source = f"rollout {number} ({rollout['type']})"
    return make_log(("servo",), _ROW_S * np.arange(len(cmd)), columns, source=source)


def _model(read: Read):
    """The author's MJCF without its servo; masses are those of its meshes."""
    spec = mujoco.MjSpec.from_string(read(f"{_FOLDER}/robot.xml").decode())
    spec.assets = {
        mesh.file: read(f"{_FOLDER}/meshes/{mesh.file}") for mesh in spec.meshes
    }
    spec.meshdir = ""
    for actuator in spec.actuators:
        spec.delete(actuator)
    return spec.compile()


def _made(read: Read) -> Made:
    rollouts = json.loads(read("src/sysid/dataset/dataset.json"))["data"]
    logs = [
        _log(rollout, number)
        for number, rollout in enumerate(rollouts)
        if len(rollout["actions"]) >= _LEAST_ROWS
        and "force_limit" in rollout["targets"]
    ]
    drive = JointDrive(
        Nominal(25.0, free=True),
        Nominal(5.0, free=True),
        effort="none",
        effects={
            "coulomb_friction": {"torque_nm": Nominal(0.1, free=True)},
            "armature": {"inertia_kgm2": Nominal(0.005, free=True)},
            "lowpass_cutoff": {"cutoff_hz": Nominal(1.6, free=True)},
        },
    )
    return logs, model_mechanism(_model(read), {"servo": drive})


RECORD = Record(
    name="miuzei_limit",
    robot="hobby servo with an arm of 0.35 kg, positions, 50 Hz",
    repository="mauicv/servo-sysid",
    commit="e4a484078991",
    licence="none",
    half="first",
    effects=("torque_limit",),
    documented="a limit of the torque: 32 of the motions are for it alone, 2.7 N·m is "
    "where the author's search begins",
    where="src/sysid/dataset/dataset.json, `targets`; src/sysid/desc/robot.xml",
    made=_made,
    remark="Wrong. Gains, friction, rotor and low-pass are all free here, since nobody"
    " knows them, and a load that lies elsewhere, or an encoder that is "
    "zero elsewhere, takes up what the motion lacks.",
)
