"""All effects by name, in the order in which a model should have them."""

from collections.abc import Mapping

from envs.actuator.effect import EffectKind
from envs.actuator.effects import (
    acceleration_limit,
    armature,
    asymmetric_friction,
    asymmetric_viscous,
    backlash,
    clock_drift,
    command_quantization,
    compliance,
    coulomb_friction,
    damping,
    deadband,
    directional_slew,
    encoder_eccentricity,
    encoder_offset,
    encoder_scale,
    finger_weakness,
    floor_tilt,
    friction_anisotropy,
    hysteresis,
    imu_bias,
    imu_misalignment,
    joint_coupling,
    load_friction,
    lowpass_cutoff,
    mount_tilt,
    payload_com,
    payload_mass,
    sensor_latency,
    slew_limit,
    start_torque,
    stiffness,
    stribeck_friction,
    supply_sag,
    thermal_derating,
    tip_friction,
    torque_limit,
    torque_slope_limit,
    transport_delay,
    viscous_friction,
)
from envs.errors import InputError, one_of

_MODULES = (
    mount_tilt,  # turns gravity for those that follow
    payload_mass,
    payload_com,
    transport_delay,
    command_quantization,
    lowpass_cutoff,
    slew_limit,
    directional_slew,
    acceleration_limit,  # takes the limits of the speed into its profile
    encoder_offset,
    encoder_scale,
    encoder_eccentricity,
    stiffness,
    damping,
    deadband,
    start_torque,
    torque_limit,
    torque_slope_limit,
    thermal_derating,
    supply_sag,
    finger_weakness,
    backlash,
    compliance,
    joint_coupling,
    hysteresis,
    coulomb_friction,
    viscous_friction,
    stribeck_friction,
    load_friction,
    asymmetric_friction,  # after all that it may take from
    asymmetric_viscous,
    armature,
    sensor_latency,
    clock_drift,
    floor_tilt,
    tip_friction,
    friction_anisotropy,  # takes the friction that tip_friction left
    imu_bias,
    imu_misalignment,
)

CATALOGUE: Mapping[str, EffectKind] = {m.EFFECT.name: m.EFFECT for m in _MODULES}


def effect_kind(name: str) -> EffectKind:
    """Returns an effect by name.

    Raises:
        InputError: there is none of this name.
    """
    if name not in CATALOGUE:
        raise InputError("effect", "name", name, one_of(CATALOGUE, name))
    return CATALOGUE[name]
