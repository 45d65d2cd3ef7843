"""A stand as the product's mechanism, and the truth in the product's terms."""

from dataclasses import replace

from hidden.cases import Case
from hidden.plant import ROTOR_SHARE, build
from hidden.stands import TOLERANCES, Stand
from hidden.truth import Joint

from sysid.mechanism import Figure, JointDrive, Mechanism, model_mechanism


def believed(stand: Stand) -> Mechanism:
    """Returns what a user would hand over together with the log."""
    joints = stand.mechanism.joints
    drives = {n: _drive(j) for n, j in zip(stand.names, joints, strict=True)}
    # How the stand is turned is in the header of its log.
    upright = replace(stand.mechanism, base_quat_w=(1.0, 0.0, 0.0, 0.0))
    return model_mechanism(build(upright).model, drives)


def _drive(joint: Joint) -> JointDrive:
    path = {
        "transport_delay": {"delay_s": (joint.delay_s, "delay_s")},
        "lowpass_cutoff": {"cutoff_hz": (joint.lowpass_hz, "lowpass_hz")},
        "slew_limit": {"speed_rad_s": (joint.slew_rad_s, "slew_rad_s")},
        "torque_limit": {"limit_nm": (joint.limit_nm, "kp")},
    }
    return JointDrive(
        kp=Figure(joint.kp, TOLERANCES["kp"]),
        kd=Figure(joint.kd, TOLERANCES["kd"]),
        effects={
            name: {key: Figure(v, TOLERANCES[t]) for key, (v, t) in values.items()}
            for name, values in path.items()
        },
    )


def true_parameters(case: Case, effect: str) -> dict[str, float]:
    """Returns what a perfect diagnosis would report, as far as it has one name.

    Where the effect is another value of a believed figure, the figure's own error
    belongs to it.
    """
    index = case.stand.names.index(case.joint)
    true, believed_ = case.truth.joints[index], case.stand.mechanism.joints[index]
    values = true.effects[effect]
    match effect:
        case "transport_delay":
            return {"delay_s": true.delay_s + values["delay_s"]}
        case "stiffness":
            return {"scale": true.kp * values["scale"] / believed_.kp}
        case "damping":
            return {"scale": true.kd * values["scale"] / believed_.kd}
        case "encoder_offset":
            return {"offset_rad": true.offset_rad + values["offset_rad"]}
        case "armature":
            extra = true.armature - believed_.armature
            return {"inertia_kgm2": values["inertia_kgm2"] + extra}
        case "thermal_derating":
            cool = values["cooling_per_s"]
            loss = values["fall_per_nm2s"] / cool
            return {"loss_per_nm2": loss, "time_constant_s": 1.0 / cool}
        case "supply_sag":
            return {"sag_per_nm": values["per_nm"]}
        case "compliance":
            return {
                "compliance_rad_nm": 1.0 / values["stiffness_nm_rad"],
                "motor_inertia_kgm2": ROTOR_SHARE * true.armature,
            }
        case "joint_coupling":
            return {"stiffness_nm_rad": -values["stiffness_nm_rad"]}
        case "clock_drift":
            return {"drift_ppm": -1e6 * values["drift"]}
        case "payload_mass":
            return {"mass_kg": case.truth.payload_kg[index]}
        case "mount_tilt" if case.stand.kind == "pendulum":
            return {"pitch_rad": -values["angle_rad"]}
        case "mount_tilt":
            return {}
    return dict(values)
