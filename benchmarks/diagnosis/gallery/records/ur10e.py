"""A UR10e with a load of 2.8 kg that its controller does not know: S. Mamedov.

Masses, rotors, friction and torques per ampere are those that the authors identified
without the load; the masses of the maker's URDF file are 20 % off.
"""

import io
import re
import xml.etree.ElementTree as ET

import numpy as np
from jaxtyping import Float

from benchmarks.diagnosis.gallery.chain import symmetric
from benchmarks.diagnosis.gallery.models import driven_columns, urdf_model
from benchmarks.diagnosis.gallery.record import Made, Read, Record
from sysid.drive import JointDrive, Nominal
from sysid.logs.log import make_log
from sysid.mechanism import model_mechanism

_LINKS = (
    *("shoulder_link", "upper_arm_link", "forearm_link"),
    *("wrist_1_link", "wrist_2_link", "wrist_3_link"),
)
_JOINTS = (
    *("shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint"),
    *("wrist_1_joint", "wrist_2_joint", "wrist_3_joint"),
)
_USED = slice(307, 5071)
"""Rows that the authors use."""


def _identified(text: str, name: str) -> Float[np.ndarray, " n"]:
    """Numbers of one list in UR10E_parameters.txt."""
    (found,) = re.findall(rf"{name} = \[(.*?)\]", text, re.DOTALL)
    return np.array([float(x) for x in found.split()])


def _with_inertials(urdf: bytes, links: Float[np.ndarray, "6 10"]) -> bytes:
    """Puts Ixx, Ixy, Ixz, Iyy, Iyz, Izz at a link's frame, m c and m into the file."""
    robot = ET.fromstring(urdf)
    for name, row in zip(_LINKS, links, strict=True):
        mass, com = row[9], row[6:9] / row[9]
        inertia = symmetric(row[:6]) - mass * (
            com @ com * np.eye(3) - np.outer(com, com)
        )
        inertial = robot.find(f"link[@name='{name}']/inertial")
        assert inertial is not None
        inertial.clear()
        xyz = " ".join(map(str, com))
        ET.SubElement(inertial, "origin", {"xyz": xyz, "rpy": "0 0 0"})
        ET.SubElement(inertial, "mass", {"value": str(mass)})
        values = map(str, (inertia + 1e-6 * np.eye(3))[np.triu_indices(3)])
        keys = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
        ET.SubElement(inertial, "inertia", dict(zip(keys, values, strict=True)))
    return ET.tostring(robot)


def _drives(text: str) -> dict[str, JointDrive]:
    friction = _identified(text, "pi_frcn").reshape(6, 3)
    gains, rotors = _identified(text, "drvGains"), _identified(text, "pi_drvs")
    return {
        joint: JointDrive(
            Nominal(1.0),
            Nominal(1.0),
            effort="cur",
            effort_scale=Nominal(float(gains[k]), 0.05),
            effects={
                "viscous_friction": {
                    "damping_nms": Nominal(float(friction[k, 0]), 0.3)
                },
                "coulomb_friction": {"torque_nm": Nominal(float(friction[k, 1]), 0.3)},
                "armature": {"inertia_kgm2": Nominal(float(rotors[k]), free=True)},
            },
            known="mechanics",
        )
        for k, joint in enumerate(_JOINTS)
    }


def _made(read: Read) -> Made:
    path = "dataset_ur10e/identification_data/ur-20_02_19_14harm50secLoad.csv"
    table = np.loadtxt(io.BytesIO(read(path)), delimiter=",")[_USED]
    columns = driven_columns(_JOINTS, table.T[1:7], table.T[13:19], "cur")
    log = make_log(_JOINTS, table[:, 0] - table[0, 0], columns, source=path)
    text = read("UR10E_parameters.txt").decode()
    links = _identified(text, "pi_rgd").reshape(6, 10)
    urdf = _with_inertials(read("URe/urdf/ur10e.urdf"), links)
    model = urdf_model(urdf, payload="ee_link")
    return [log], model_mechanism(model, _drives(text))


RECORD = Record(
    name="ur10e_payload",
    robot="arm UR10e with a load, angles and currents, 100 Hz",
    repository="shamilmamedov/dynamic_calibration",
    commit="11af40e7deb7",
    licence="none",
    half="first",
    effects=("payload_mass",),
    documented="a load of 2.805 kg that the nominal model does not have",
    where="estimate_drive_gains.m, lines 18 to 20; Frontiers in Robotics and AI 7, "
    "2020, doi 10.3389/frobt.2020.571574",
    made=_made,
    remark="Right: the load, in the shoulder, and nothing else; the elbow, which "
    "carries it far out as well, does not name it any more. Its size is half of"
    " what it is: its place at the flange is assumed, and masses may be 5 % "
    "off. By its probabilities no effect is likelier.",
)
