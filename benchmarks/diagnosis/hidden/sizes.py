"""Effects by one size each: from a positive number to parameters in a mechanism."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.diagnosis.hidden.truth import Mechanism

Apply = Callable[[Mechanism, int, float, np.random.Generator], Mechanism]


@dataclass(frozen=True)
class Scale:
    """How an effect grows.

    Attributes:
        apply: (mechanism, joint, size, generator of shapes) -> with the effect.
        low, high: sizes to search.
        release: nominal parameter that the effect is a change of, "" if none.
        least: smallest size that is more than a tolerance: four of them.
        kinds: stands that can show it.
    """

    apply: Apply
    low: float
    high: float
    release: str = ""
    least: float = 0.0
    kinds: tuple[str, ...] = ("pendulum", "joint", "finger")


def _sign(rng: np.random.Generator) -> float:
    return 1.0 if rng.random() < 0.5 else -1.0


def _effect(name: str, **make) -> Apply:
    """An effect of one joint; `make` gives each parameter from (size, generator)."""

    def apply(mechanism, joint, size, rng):
        values = {key: float(f(size, rng)) for key, f in make.items()}
        return mechanism.with_effect(joint, name, **values)

    return apply


def _size(size, rng):
    return size


def _signed(size, rng):
    return size * _sign(rng)


def _factor(size, rng):
    return math.exp(size * _sign(rng))


def _cutoff(mechanism, joint, size, rng):
    believed = mechanism.joints[joint].lowpass_hz
    value = believed * math.exp(size * _sign(rng))
    if math.isinf(believed):
        value = 6.0 / size  # a filter that nobody knows of
    return mechanism.with_effect(joint, "lowpass_cutoff", cutoff_hz=value)


def _below(name: str, parameter: str, nominal: str, top: float) -> Apply:
    """A limit: its nominal value, or `top` at most, over 1 + size."""

    def apply(mechanism, joint, size, rng):
        value = min(getattr(mechanism.joints[joint], nominal), top) / size
        return mechanism.with_effect(joint, name, **{parameter: value})

    return apply


def _one_way(mechanism, joint, size, rng):
    """A speed limit of one direction."""
    way = "up_rad_s" if rng.random() < 0.5 else "down_rad_s"
    speed = min(mechanism.joints[joint].slew_rad_s, 8.0) / size
    return mechanism.with_effect(joint, "directional_slew", **{way: speed})


def _gentle(mechanism, joint, size, rng):
    """As if a speed of 8 rad/s took 0.02 s at size 1."""
    acceleration = 8.0 / (0.02 * size)
    return mechanism.with_effect(
        joint, "acceleration_limit", acceleration_rad_s2=acceleration
    )


def _slope(mechanism, joint, size, rng):
    """As if the error could grow by 20 rad/s at size 1."""
    slope = 20.0 * mechanism.joints[joint].kp / size
    return mechanism.with_effect(joint, "torque_slope_limit", slope_nm_s=slope)


def _rotor(mechanism, joint, size, rng):
    inertia = size * mechanism.joints[joint].armature
    return mechanism.with_effect(joint, "armature", inertia_kgm2=inertia)


def _compliance(mechanism, joint, size, rng):
    j = mechanism.joints[joint]
    stiffness = j.kp / size
    damping = 0.2 * math.sqrt(stiffness * j.armature)
    return mechanism.with_effect(
        joint,
        "compliance",
        stiffness_nm_rad=stiffness,
        damping_nms_rad=damping,
    )


def _eccentricity(mechanism, joint, size, rng):
    phase = rng.uniform(0.0, 2.0 * math.pi)
    return mechanism.with_effect(
        joint,
        "encoder_eccentricity",
        sine_rad=size * math.sin(phase),
        cosine_rad=size * math.cos(phase),
    )


def _payload(mechanism, joint, size, rng):
    """The last link carries the load, whichever joint feels it."""
    masses = list(mechanism.payload_kg or (0.0,) * len(mechanism.links))
    added = size * mechanism.links[-1].mass
    masses[-1] += added
    hidden = replace(mechanism, payload_kg=tuple(masses))
    return hidden.with_effect(joint, "payload_mass", mass_kg=added)


def _shift(mechanism, joint, size, rng):
    """The load of the last link lies elsewhere."""
    shift = size * _sign(rng)
    hidden = replace(mechanism, payload_shift_m=shift)
    return hidden.with_effect(joint, "payload_com", shift_m=shift)


def _tilt(mechanism, joint, size, rng):
    tilt = size * _sign(rng)
    hidden = replace(mechanism, tilt_rad=(0.0, tilt))
    return hidden.with_effect(joint, "mount_tilt", angle_rad=tilt)


def _sag(mechanism, joint, size, rng):
    hidden = replace(mechanism, sag_per_nm=size)
    return hidden.with_effect(joint, "supply_sag", per_nm=size)


def _coupling(mechanism, joint, size, rng):
    n = len(mechanism.joints)
    other = joint + 1 if joint + 1 < n else joint - 1
    stiffness = size * _sign(rng)
    return mechanism.with_effect(
        joint, "joint_coupling", other=other, stiffness_nm_rad=stiffness
    )


def _slack(mechanism, joint, size, rng):
    """A return cable that pulls on one side of the middle of the motion only."""
    slack = _middle(mechanism, joint) - rng.uniform(-0.2, 0.1)
    return mechanism.with_effect(
        joint, "cable_slack", length_rad=slack, stiffness_nm_rad=size
    )


def _catch(mechanism, joint, size, rng):
    """A latch that the joint passes."""
    return mechanism.with_effect(
        joint,
        "contact_catch",
        size_nm=size,
        angle_rad=_middle(mechanism, joint) + rng.uniform(-0.2, 0.2),
        reach_rad=rng.uniform(0.03, 0.08),
        damping=0.05 * size,
    )


def _middle(mechanism, joint) -> float:
    low, high = mechanism.links[joint].range_rad
    return 0.5 * (low + high)


def _uniform(low: float, high: float):
    return lambda size, rng: rng.uniform(low, high)


SCALES: dict[str, Scale] = {
    "transport_delay": Scale(
        _effect("transport_delay", delay_s=_size), 1e-3, 0.08, "delay_s", 0.004
    ),
    "lowpass_cutoff": Scale(_cutoff, 1e-2, 1.5, "lowpass_hz", 0.2),
    "command_quantization": Scale(
        _effect("command_quantization", step_rad=_size), 1e-4, 0.2
    ),
    "slew_limit": Scale(
        _below("slew_limit", "speed_rad_s", "slew_rad_s", 8.0),
        1.0,
        40.0,
        "slew_rad_s",
        1.2,
    ),
    "directional_slew": Scale(_one_way, 1.0, 40.0, "slew_rad_s", 1.2),
    "acceleration_limit": Scale(_gentle, 0.1, 400.0),
    "torque_slope_limit": Scale(_slope, 1e-2, 1e3),
    "stiffness": Scale(_effect("stiffness", scale=_factor), 1e-2, 1.2, "kp", 0.2),
    "damping": Scale(_effect("damping", scale=_factor), 1e-2, 1.2, "kd", 0.4),
    "deadband": Scale(_effect("deadband", half_width_rad=_size), 1e-4, 0.1),
    "start_torque": Scale(
        _effect("start_torque", torque_nm=_size, from_rad=_uniform(0.001, 0.006)),
        1e-4,
        1.0,
    ),
    "torque_limit": Scale(
        _below("torque_limit", "limit_nm", "limit_nm", 2.0), 1.0, 100.0, least=1.2
    ),
    "thermal_derating": Scale(
        _effect(
            "thermal_derating", fall_per_nm2s=_size, cooling_per_s=_uniform(0.03, 0.1)
        ),
        1e-2,
        1e3,
    ),
    "supply_sag": Scale(_sag, 1e-2, 10.0),
    "backlash": Scale(_effect("backlash", gap_rad=_size), 1e-4, 0.2),
    "compliance": Scale(_compliance, 1e-3, 2.0),
    "hysteresis": Scale(
        _effect("hysteresis", torque_nm=_size, range_rad=_uniform(0.02, 0.06)),
        1e-4,
        0.5,
    ),
    "joint_coupling": Scale(_coupling, 1e-4, 2.0, kinds=("finger",)),
    "coulomb_friction": Scale(_effect("coulomb_friction", torque_nm=_size), 1e-4, 0.5),
    "asymmetric_friction": Scale(
        _effect("asymmetric_friction", difference_nm=_signed), 1e-4, 0.5
    ),
    "viscous_friction": Scale(
        _effect("viscous_friction", damping_nms=_size), 1e-4, 1.0
    ),
    "asymmetric_viscous": Scale(
        _effect("asymmetric_viscous", difference_nms=_signed), 1e-4, 1.0
    ),
    "stribeck_friction": Scale(
        _effect("stribeck_friction", extra_nm=_size, speed_rad_s=_uniform(0.1, 0.3)),
        1e-4,
        0.5,
    ),
    "load_friction": Scale(
        lambda m, j, s, rng: m.with_effect(
            j, "load_friction", drive_share=s, load_share=s
        ),
        1e-3,
        1.0,
    ),
    "armature": Scale(_rotor, 1e-2, 20.0, "armature", 0.2),
    "encoder_offset": Scale(
        _effect("encoder_offset", offset_rad=_signed), 1e-3, 0.5, "offset_rad", 0.004
    ),
    "encoder_scale": Scale(_effect("encoder_scale", scale=_factor), 1e-3, 0.5),
    "encoder_eccentricity": Scale(_eccentricity, 1e-3, 0.2),
    # Readings that are late look exactly like targets that come late.
    "sensor_latency": Scale(
        _effect("sensor_latency", latency_s=_size), 1e-4, 0.08, "delay_s", 0.004
    ),
    "clock_drift": Scale(_effect("clock_drift", drift=_signed), 1e-5, 0.02),
    "payload_mass": Scale(_payload, 1e-2, 10.0, "mass", 0.2),
    "payload_com": Scale(_shift, 1e-4, 0.1),
    "mount_tilt": Scale(_tilt, 1e-3, 0.6),
    "gear_ripple": Scale(
        _effect(
            "gear_ripple",
            size_nm=_size,
            teeth=_uniform(20.0, 40.0),
            other_teeth=_uniform(55.0, 90.0),
        ),
        1e-4,
        1.0,
    ),
    "cable_slack": Scale(_slack, 1e-3, 10.0),
    "packet_reorder": Scale(
        lambda m, j, s, rng: m.with_effect(j, "packet_reorder", every=1.0 / s),
        1e-3,
        0.5,
    ),
    "contact_catch": Scale(_catch, 1e-3, 2.0),
}
"""Every effect that can be hidden; the last four are outside the catalogue."""
