"""A KUKA KR300 with 150 kg: J. Weigand, J. Ulmen, A. Janot, M. Ruskowski.

Masses, inertias, rotors and ratios are the nominal ones of
robot_model/model_KUKA_Quantec_Ultra_KR300.m, with the load that
MASTER_create_symbolic_robot.m puts on the last axis. The hydraulic counterbalance of
axis 2 is the push that hydraulic_weight_counterbalance.m gives, of unknown size.
"""

import io
from typing import Any

import numpy as np
import scipy.io
from jaxtyping import Float

from benchmarks.diagnosis.gallery.chain import Link, chain_model, shifted, symmetric
from benchmarks.diagnosis.gallery.models import DRIVEN, driven_columns
from benchmarks.diagnosis.gallery.record import Made, Read, Record
from sysid.logs.log import MeasuredLog, make_log
from sysid.mechanism import model_mechanism

_AXES = tuple(f"axis{k}" for k in range(1, 7))

_START_RAD = np.array([0.0, -np.pi / 2, np.pi, 0.0, 0.0, 0.0])
"""Angles at the zero of the records: robot_dynamics.m, and the model's `offset`."""

_RATIO = np.array([1798 / 7, 1872 / 7, 757 / 3, 221.0, 5032 / 21, 206793 / 1340])
_ROTOR_KGM2 = np.array([0.00923, 0.0118, 0.0118, 0.00173, 0.00173, 0.00173])

_DH = (
    (-0.675, 0.35, np.pi / 2),
    (-0.189, 1.15, 0.0),
    (0.189, 0.041, -np.pi / 2),
    (-1.0, 0.0, np.pi / 2),
    (0.0, 0.0, -np.pi / 2),
    (-0.24, 0.0, np.pi),
)
"""d [m], a [m] and α [rad], Denavit-Hartenberg: frames are at the ends of links."""

_MASS_KG = np.array([395.4, 339.12, 105.21, 35.8, 31.46, 17.78 + 150.0])

_COM_MM = np.array(
    [
        [-353.0, 174.0, -4.0],
        [-709.0, -1.0, 23.0],
        [-18.0, -18.0, -76.0],
        [0.0, 236.0, 1.0],
        [0.0, -80.0, -9.0],
        [0.0, 0.0, (150.0 * 100.0 - 17.78 * 50.0) / (17.78 + 150.0)],
    ]
)

_INERTIA_KGMM2 = np.array(
    [
        [16733765.0, -1703664.0, 4404062.0, 29799119.0, 129384.0, 32814954.0],
        [7507819.0, 430046.0, -4396607.0, 88886691.0, 173157.0, 88673761.0],
        [10783798.0, 118474.0, -101950.0, 10186135.0, -606384.0, 1943179.0],
        [425035.0, -4.0, -27.0, 217993.0, -11353.0, 428465.0],
        [283826.0, -4.0, -120.0, 229562.0, -19521.0, 258266.0],
        [1.0, 0.0, 0.0, 1.0, 0.0, 1.0],
    ]
)
"""Ixx, Ixy, Ixz, Iyy, Iyz, Izz; the file gives none for the last axis."""


def _model() -> Any:
    """Hangs the file's frames, whose base is upside down, into the world."""
    links, before = {}, shifted((0.0, 0.0, 0.0), np.pi)
    for k, (axis, (d, a, alpha)) in enumerate(zip(_AXES, _DH, strict=True)):
        end = shifted((a, 0.0, d), alpha)
        turn = end[:3, :3]
        com = turn @ _COM_MM[k] * 1e-3 + end[:3, 3]
        inertia = turn @ symmetric(_INERTIA_KGMM2[k] * 1e-6) @ turn.T
        rotor = float(_ROTOR_KGM2[k] * _RATIO[k] ** 2)
        links[axis] = Link(before, _MASS_KG[k], com, inertia, armature=rotor)
        before = end
    return chain_model(links)


def _counterbalance_nm(angle: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    """Torque of the gas spring that holds axis 2 up, on its lever."""
    anchor_m, crank_m = 0.8, 0.2
    piston_m2 = np.pi * (0.055**2 - 0.03**2) / 4.0
    turn = angle + np.deg2rad(95.0)
    long_m = np.sqrt(anchor_m**2 + crank_m**2 - 2.0 * anchor_m * crank_m * np.cos(turn))
    lever_m = np.sin(turn) * anchor_m * crank_m / long_m
    gas_m3 = 2.0 * 0.00048 - (long_m - (anchor_m - crank_m)) * piston_m2
    pressure_pa = 1.01 * 296.8 * 328.0 * 2.0 * 0.0795 / gas_m3
    return -lever_m * pressure_pa * piston_m2


def _log(read: Read, name: str) -> MeasuredLog:
    """One record: angles of the motors, and their torques times the ratios."""
    path = f"data/recorded_trajectories/2020-10-21 10s FF {name} 08ms/data.mat"
    found = scipy.io.loadmat(
        io.BytesIO(read(path)), squeeze_me=True, struct_as_record=False
    )["rec"]
    angles = np.deg2rad(found.act_pos_mot_deg) + _START_RAD[:, None]
    torques = found.act_torque_abs_nm * _RATIO[:, None]
    columns = driven_columns(_AXES, angles, torques)
    columns["ext.axis2"] = _counterbalance_nm(angles[1])
    return make_log(_AXES, found.time_cont, columns, source=path)


def _made(read: Read) -> Made:
    logs = [_log(read, name) for name in "ABC"]
    return logs, model_mechanism(_model(), dict.fromkeys(_AXES, DRIVEN))


RECORD = Record(
    name="kr300_friction",
    robot="arm KUKA KR300 with 150 kg, six axes, angles and torques of the motors, "
    "250 Hz",
    repository="JonasWeigand/Robot_Identification",
    commit="9e403c07d9da",
    licence="MIT",
    half="second",
    effects=("asymmetric_friction", "coulomb_friction", "viscous_friction"),
    documented="dry friction of about 350 to 540 N·m and viscous friction of 1560 to "
    "1940 N·m·s/rad in axes 1 to 3, and 4 to 18 N·m that make it larger one way",
    where="ident_functions/nonlinear_differential_model.m; sizes: data/data_ref.mat",
    made=_made,
    remark="Right, with the sizes of the authors in axes 1, 5 and 6: dry 337 (311 to"
    " 362), 137 (106 to 168) and 99 (80 to 118) N·m, theirs are 350, 125 and 88; "
    "viscous 2010 (1900 to 2120), 543 (365 to 721) and 377 (370 to 385) N·m·s/rad, "
    "theirs are 1940, 468 and 384. In axes 2 and 3 the viscous part is not named, and"
    " the dry one is too large (805 and 736 for 538 and 377 N·m). Axis 4 is named "
    "Stribeck friction of a speed that the records do not show, which is dry "
    "friction: 167 for 94 N·m.",
)
