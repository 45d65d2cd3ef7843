"""Another unit of force: all masses, torques and inertias times one factor.

The motion stays exactly the same, so a verdict must stay the same as well.
"""

from dataclasses import replace

from benchmarks.diagnosis.hidden.stands import Stand
from benchmarks.diagnosis.hidden.truth import Joint, Mechanism
from sysid.logs.log import MeasuredLog, make_log

POWERS = {
    "torque_nm": 1,
    "difference_nm": 1,
    "extra_nm": 1,
    "size_nm": 1,
    "limit_nm": 1,
    "slope_nm_s": 1,
    "damping_nms": 1,
    "difference_nms": 1,
    "damping_nms_rad": 1,
    "stiffness_nm_rad": 1,
    "damping": 1,
    "inertia_kgm2": 1,
    "mass_kg": 1,
    "per_nm": -1,
    "fall_per_nm2s": -2,
}
"""Power of the factor by which a parameter grows; those that are not here stay."""


def scaled_mechanism(mechanism: Mechanism, factor: float) -> Mechanism:
    """Returns the mechanism with all forces times a factor."""
    links = tuple(
        replace(
            link,
            mass=link.mass * factor,
            inertia=tuple(x * factor for x in link.inertia),
        )
        for link in mechanism.links
    )
    return replace(
        mechanism,
        links=links,
        joints=tuple(_scaled_joint(joint, factor) for joint in mechanism.joints),
        payload_kg=tuple(x * factor for x in mechanism.payload_kg),
        sag_per_nm=mechanism.sag_per_nm / factor,
    )


def _scaled_joint(joint: Joint, factor: float) -> Joint:
    effects = {
        effect: {n: x * factor ** POWERS.get(n, 0) for n, x in values.items()}
        for effect, values in joint.effects.items()
    }
    return replace(
        joint,
        kp=joint.kp * factor,
        kd=joint.kd * factor,
        k_int=joint.k_int * factor,
        armature=joint.armature * factor,
        limit_nm=joint.limit_nm * factor,
        effects=effects,
    )


def scaled_stand(stand: Stand, factor: float) -> Stand:
    """Returns a stand with all forces times a factor."""
    return replace(stand, mechanism=scaled_mechanism(stand.mechanism, factor))


def logged(log: MeasuredLog, factor: float, effort: bool) -> MeasuredLog:
    """Returns a log with the effort times a factor, or without it."""
    columns = {
        name: values * (factor if name.startswith("tau.") else 1.0)
        for name, values in log.columns.items()
        if effort or not name.startswith("tau.")
    }
    quat_w = log.header.palm_quat_w
    return make_log(
        log.header.joints, log.t_s, columns, palm_quat_w=quat_w, source=log.source
    )
