"""A stand as the product's mechanism, and the truth in the product's terms."""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from benchmarks.diagnosis.hidden.cases import Case
from benchmarks.diagnosis.hidden.plant import ROTOR_SHARE, build
from benchmarks.diagnosis.hidden.stands import TOLERANCES, Stand
from benchmarks.diagnosis.hidden.truth import Joint
from sysid.drive import Cascade, Effort, JointDrive, Masses, Nominal
from sysid.mechanism import Mechanism, model_mechanism


def believed(stand: Stand, effort: bool = True) -> Mechanism:
    """Returns what a user would hand over together with the log."""
    joints = stand.mechanism.joints
    drives = {
        name: _drive(joint, stand, "tau" if effort else "none")
        for name, joint in zip(stand.names, joints, strict=True)
    }
    # How the stand is turned is in the header of its log.
    upright = replace(stand.mechanism, base_quat_w=(1.0, 0.0, 0.0, 0.0))
    return model_mechanism(build(upright).model, drives)


def _drive(joint: Joint, stand: Stand, effort: Effort) -> JointDrive:
    known = stand.tolerances
    path = {
        "transport_delay": {"delay_s": (joint.delay_s, "delay_s")},
        "lowpass_cutoff": {"cutoff_hz": (joint.lowpass_hz, "lowpass_hz")},
        "slew_limit": {"speed_rad_s": (joint.slew_rad_s, "slew_rad_s")},
        "torque_limit": {"limit_nm": (joint.limit_nm, "kp")},
    }
    return JointDrive(
        **_gains(joint, known, stand.gains_free),
        effort=effort,
        masses=Masses(known["mass"]),
        effects={
            name: {key: _nominal(v, _known(known, t)) for key, (v, t) in values.items()}
            for name, values in path.items()
            if all(math.isfinite(v) for v, _ in values.values())
        },
    )


def _gains(joint: Joint, known: Mapping[str, float], free: bool) -> dict[str, Any]:
    """What the manual of the drive says: two gains, or those of two loops."""
    kd = Nominal(joint.kd, known["kd"], free)
    if not joint.k_int and math.isinf(joint.ref_rad_s):
        return {"kp": Nominal(joint.kp, known["kp"], free), "kd": kd}
    k_pos = Nominal(joint.kp / joint.kd, known["kp"], free)
    k_int = Nominal(joint.k_int, known["k_int"], free)
    return {"cascade": Cascade(k_pos, kd, k_int, joint.ref_rad_s)}


def _nominal(value: float, tolerance: float) -> Nominal:
    """A value and its relative tolerance: of nothing there is nothing to be wrong.

    A drive's tolerance of a zero is in its own unit: as one of delay, a twentieth would
    be 50 ms, in which any latency hides.
    """
    return Nominal(value, tolerance if value else 0.0)


def _known(tolerances: Mapping[str, float], name: str) -> float:
    """Tolerance of a parameter; a limit of the torque is known as well as ever."""
    return TOLERANCES["kp"] if name == "kp" else tolerances[name]


def true_parameters(case: Case, effect: str) -> dict[str, float]:
    """Returns what a perfect diagnosis would report, as far as it has one name.

    Where the effect is another value of a nominal parameter, that one's own error
    belongs to it. Of a tilt, one joint shows one axis: only the pendulum's is known.
    """
    index = case.stand.names.index(case.joint)
    true, believed_ = case.truth.joints[index], case.stand.mechanism.joints[index]
    values = true.effects[effect]
    if effect == "mount_tilt":
        upright = case.stand.kind == "pendulum"
        return {"pitch_rad": -values["angle_rad"]} if upright else {}
    if effect == "payload_mass":
        return {"mass_kg": case.truth.payload_kg[-1]}
    if effect in _TRANSLATED:
        return _TRANSLATED[effect](values, true, believed_)
    return dict(values)


_TRANSLATED = {
    "transport_delay": lambda v, true, was: {"delay_s": true.delay_s + v["delay_s"]},
    "stiffness": lambda v, true, was: {"scale": true.kp * v["scale"] / was.kp},
    "damping": lambda v, true, was: {"scale": true.kd * v["scale"] / was.kd},
    "encoder_offset": lambda v, true, was: {
        "offset_rad": true.offset_rad + v["offset_rad"]
    },
    "armature": lambda v, true, was: {
        "inertia_kgm2": v["inertia_kgm2"] + true.armature - was.armature
    },
    "thermal_derating": lambda v, true, was: {
        "loss_per_nm2": v["fall_per_nm2s"] / v["cooling_per_s"],
        "time_constant_s": 1.0 / v["cooling_per_s"],
    },
    "supply_sag": lambda v, true, was: {"sag_per_nm": v["per_nm"]},
    "compliance": lambda v, true, was: {
        "compliance_rad_nm": 1.0 / v["stiffness_nm_rad"],
        "motor_inertia_kgm2": ROTOR_SHARE * true.armature,
    },
    # Masing: after a reversal Jenkins elements need twice the way of a first loading,
    # which Dahl's curve does not.
    "hysteresis": lambda v, true, was: {**v, "range_rad": 2.0 * v["range_rad"]},
    "joint_coupling": lambda v, true, was: {"stiffness_nm_rad": -v["stiffness_nm_rad"]},
    "clock_drift": lambda v, true, was: {"drift_ppm": -1e6 * v["drift"]},
}
"""Hidden parameters in the product's units: (values, true joint, believed joint)."""
