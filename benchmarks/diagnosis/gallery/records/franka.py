"""A Franka Emika Panda on an exciting trajectory: C. Gaz, M. Cognetti, A. Oliva.

Masses, centres and inertias are those that the authors retrieved from the robot, with
the friction beside them, which is left out here.
"""

import re
from typing import Any

import numpy as np
from jaxtyping import Float

from benchmarks.diagnosis.gallery.chain import Link, chain_model, shifted, symmetric
from benchmarks.diagnosis.gallery.models import DRIVEN, driven_columns
from benchmarks.diagnosis.gallery.record import Made, Read, Record
from sysid.logs.log import make_log
from sysid.mechanism import model_mechanism

_JOINTS = tuple(f"joint{k}" for k in range(1, 8))
_LOG = "matlab/data/Exciting_Traj/Trajectory_1/rbt_log/exciting_traj"

_DH = (
    (0.333, 0.0, 0.0),
    (0.0, 0.0, -np.pi / 2),
    (0.316, 0.0, np.pi / 2),
    (0.0, 0.0825, np.pi / 2),
    (0.384, -0.0825, -np.pi / 2),
    (0.0, 0.0, np.pi / 2),
    (0.0, 0.088, np.pi / 2),
)
"""d [m], a [m] and α [rad], modified Denavit-Hartenberg (Load_Franka_DH.m)."""


def _matrix(text: str, name: str, width: int) -> Float[np.ndarray, "7 w"]:
    """Numbers of one matrix in DynPars2VREP.m, a row for every link."""
    (found,) = re.findall(rf"^{name} *= *\[(.*?)\]", text, re.DOTALL | re.MULTILINE)
    numbers = [float(x) for x in re.split(r"[\s,;]+", found.strip())]
    return np.array(numbers).reshape(-1, width)


def _model(text: str) -> Any:
    masses, coms = _matrix(text, "m", 1), _matrix(text, "CoM_l", 3)
    inertias = _matrix(text, "Il", 6)
    links = {}
    for k, (joint, (d, a, alpha)) in enumerate(zip(_JOINTS, _DH, strict=True)):
        place = shifted((a, -np.sin(alpha) * d, np.cos(alpha) * d), alpha)
        links[joint] = Link(place, masses[k, 0], coms[k], symmetric(inertias[k]))
    return chain_model(links)


def _made(read: Read) -> Made:
    def table(name: str) -> Float[np.ndarray, " n"]:
        return np.array(read(f"{_LOG}_{name}.txt").split(), float)

    angles, torques = (table(x).reshape(-1, 7) for x in ("positions", "torques"))
    columns = driven_columns(_JOINTS, angles.T, torques.T)
    log = make_log(_JOINTS, table("time"), columns, source=_LOG)
    text = read("matlab/ConvertDynPars2VREP/DynPars2VREP.m").decode("latin-1")
    return [log], model_mechanism(_model(text), dict.fromkeys(_JOINTS, DRIVEN))


RECORD = Record(
    name="franka_friction",
    robot="arm Franka Emika Panda, seven joints, angles and torques, 1 kHz",
    repository="marcocognetti/FrankaEmikaPandaDynModel",
    commit="24d85ce4e648",
    licence="GPL-3.0",
    half="second",
    effects=("coulomb_friction",),
    documented="friction that rises over a few tenths of a rad/s and then stays, at "
    "0.15 to 0.64 N·m in each joint",
    where="matlab/dyn_model_panda/get_FrictionTorque.m; IEEE Robotics and Automation "
    "Letters 4(4), 2019",
    made=_made,
    remark="Right: Coulomb friction in joints 6 and 7, 0.16 (0.13 to 0.19) and 0.27 "
    "N·m (0.21 to 0.33), where the authors have 0.15 and 0.28. In joints 4 and 5 dry "
    "friction of about their size (0.56 and 0.34 N·m, theirs are 0.64 and 0.42) is "
    "called hysteresis, in joint 2 an asymmetry; in joints 1 and 3 it is not named.",
)
