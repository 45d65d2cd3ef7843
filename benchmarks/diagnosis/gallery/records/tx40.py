"""A Stäubli TX40 on an exciting trajectory, motor by motor: figaroh-examples.

Masses are those of its URDF file, rotors those of its configuration. The last two
motors turn joints 5 and 6 together; what the motor of joint 6 has of rotor and friction
beside that is not simulated.
"""

import io

import numpy as np
from jaxtyping import Float

from benchmarks.diagnosis.gallery.models import driven_columns, urdf_model
from benchmarks.diagnosis.gallery.record import Made, Read, Record
from sysid.drive import JointDrive, Nominal
from sysid.logs.log import make_log
from sysid.mechanism import model_mechanism

_FOLDER = "examples/staubli_TX40"
_JOINTS = tuple(f"joint_{k}" for k in range(1, 7))

_ROW_S = 0.0002
"""Rows have no times (config/TX40_config.yaml, `ts`)."""

_RATIO = np.diag([32.0, 32.0, 45.0, -48.0, 45.0, 32.0])
_RATIO[5, 4] = 32.0
"""Turns of the motors by those of the joints (utils/staubli_tx40_tools.py)."""

_START_RAD = np.array([0.0, -np.pi / 2, np.pi / 2, 0.0, 0.0, 0.0])
"""Angles at the zero of the motors (utils/staubli_tx40_tools.py)."""

_ROTORS_KGM2 = (0.362, 0.362, 0.0988, 0.0313, 0.0468, 0.0105)
"""Behind the gears (config/TX40_config.yaml, `Ia`)."""


def _table(read: Read, name: str) -> Float[np.ndarray, "n 6"]:
    text = read(f"{_FOLDER}/data/{name}.csv")
    return np.loadtxt(io.BytesIO(text), delimiter=",", skiprows=1)


def _drive(rotor: float) -> JointDrive:
    return JointDrive(
        Nominal(1.0),
        Nominal(1.0),
        effects={"armature": {"inertia_kgm2": Nominal(rotor, free=True)}},
        known="mechanics",
    )


def _made(read: Read) -> Made:
    """The file's currents are in N·m at the motors: the authors use them as torques."""
    angles = _table(read, "pos_read_data") @ np.linalg.inv(_RATIO).T + _START_RAD
    torques = _table(read, "curr_data") @ _RATIO
    columns = driven_columns(_JOINTS, angles.T, torques.T)
    log = make_log(_JOINTS, _ROW_S * np.arange(len(angles)), columns, source=_FOLDER)
    model = urdf_model(read(f"{_FOLDER}/urdf/tx40_mdh_modified.urdf"))
    drives = {j: _drive(rotor) for j, rotor in zip(_JOINTS, _ROTORS_KGM2, strict=True)}
    return [log], model_mechanism(model, drives)


RECORD = Record(
    name="tx40_friction",
    robot="arm Stäubli TX40, six joints, angles and torques of the motors, 5 kHz",
    repository="thanhndv212/figaroh-examples",
    commit="c0b5c7f0fda1",
    licence="none; Apache-2.0 in the headers of its code",
    half="second",
    effects=("coulomb_friction", "viscous_friction"),
    documented="Coulomb friction of 0.3 to 8.3 N·m and viscous friction of 0.65 to "
    "8.1 N·m·s/rad",
    where="examples/staubli_TX40/config/TX40_config.yaml, `fs` and `fv`",
    made=_made,
    remark="Right, with the sizes of the authors in joints 3 and 4: dry 6.5 (5.8 to "
    "7.3) and 2.5 (2.2 to 2.9) N·m, theirs are 6.3 and 2.5; viscous 1.95 (1.7 to 2.2)"
    " and 1.1 (1.0 to 1.2) N·m·s/rad, theirs are 1.97 and 1.11. In joint 2 the dry "
    "friction is named Stribeck friction of a high speed (7.8 for 8.3 N·m), in joint "
    "1 it is not named and the viscous one is too large (10 for 8), as in joint 2 "
    "(6.8 for 5.5). Motors 5 and 6 move the wrist together, which is not simulated.",
)
