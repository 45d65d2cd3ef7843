"""The coordinates of one joint: nominal values, priors, ranges and starts.

Every parameter of every effect that a joint can have is one coordinate, and so are the
nuisance parameters. Nominal values and prior standard deviations come from the drive.
"""

import math
from dataclasses import replace

import numpy as np

from envs.actuator.catalogue import CATALOGUE
from envs.actuator.effect import Parameter
from sysid.diagnosis.fits.parameters import NUISANCE, Kind, Slot, Space
from sysid.diagnosis.replay.effects import joint_effects
from sysid.diagnosis.replay.motion import JointTrack
from sysid.drive import UNIVERSAL, JointDrive, Nominal

SIGMA = 3.0**-0.5
"""Standard deviation of a uniform density within ±1 tolerance [tolerances]."""

SKEW_S = 5e-4
"""Tolerance of the age of the angle against the effort [s]."""

HOLD_S = 5e-4
"""Tolerance of the mean age of an acting torque: a servo of 1 kHz keeps one for a
millisecond [s]."""

DELAY_S = 1e-3
"""Least tolerance of a known delay [s]."""

ZERO_RAD = 1e-3
"""Tolerance of an encoder's zero where none is given [rad]."""

SAMPLED = 1.0
"""Tolerance of the share of a ripple that an effort lacks which jumps with its targets:
drives report it at one moment, before their target or behind it, or as a mean. And
what they report has their damping of the speed's ripple in it, which no row shows."""

ROTOR = 1.0
"""Tolerance of the logarithm of the motor's share of a joint's inertia."""

_GRIDS = {
    # Up to a quarter of the motion: from small plays no fit reaches a large one.
    "rad": (0.004, 0.01, 0.025, 0.06, 0.15, 0.4, 1.0, 2.5),
    # Half the width of a resonance apart: ω ∝ 1 / √C.
    "rad/(N·m)": tuple(np.geomspace(0.003, 1.5, 20).tolist()),
    # A delay off by whole intervals of the targets has a kink there, which holds a fit.
    "s": tuple(np.arange(0.1, 5.0, 0.2).tolist()),
}
_STEP_RANGE = (0.015, 1.0)
_RECIPROCAL = {
    # Where no effort was logged, what a servo would ask for at once may be thirty times
    # what it gives behind a slow low-pass, and more if its gains are unknown: a limit
    # has no slope until it is met, and a joint falls at two thirds of what it needs.
    "N·m": tuple(np.geomspace(1.0, 400.0, 43).tolist()),
    # From 2 ms, which a stiff servo takes for a step, to 1 s until the speed is that of
    # the records.
    "rad/s²": tuple(np.geomspace(0.02, 10.0, 22).tolist()),
    # A little too tight a limit is far worse than none: its optimum is narrow. One move
    # may be thrice as fast as the others, and a limit that only cuts peaks is met by a
    # few per cent of its value.
    "rad/s": tuple(np.geomspace(0.3, 2.0, 28).tolist()),
    "N·m/s": tuple(np.geomspace(0.1, 2.0, 17).tolist()),
}


def make_space(track: JointTrack, drive: JointDrive, known: dict[str, bool]) -> Space:
    """Makes the coordinates of one joint.

    Args:
        track: the records, for scales.
        drive: nominal values and tolerances.
        known: which surroundings are known, by field name.
    """
    slots, sizes = _nuisances(track, drive), _sizes(track)
    for effect in joint_effects():
        kind = CATALOGUE[effect]
        if all(known.get(name, False) for name in kind.needs):
            nominal = _nominal(drive, effect, track)
            for name, parameter in kind.parameters.items():
                slot = _slot(effect, name, parameter, sizes.get(parameter.unit))
                slot = _bounded(slot, parameter)
                value = nominal.get(name)
                slots.append(slot if value is None else _with_prior(slot, value))
    return Space(tuple(slots))


def _nuisances(track: JointTrack, drive: JointDrive) -> list[Slot]:
    """Makes the coordinates of the parameters that belong to no effect."""
    effort = math.inf if drive.effort_scale.free else drive.effort_scale.tolerance
    inertia = float(np.mean(np.asarray(track.track.inertia)))
    rotor = 0.5 * track.armature if track.armature > 0.0 else 0.1 * inertia
    slots = [
        _nuisance("effort_gain", "1", "log", 1.0, effort),
        _nuisance("mass", "1", "log", 1.0, drive.masses.tolerance),
        _nuisance("skew_s", "s", "linear", 1e-3, SKEW_S / 1e-3),
        _nuisance("hold_s", "s", "linear", 1e-3, HOLD_S / 1e-3),
        _nuisance("rotor", "kg·m²", "log", rotor, ROTOR),
    ]
    if track.effort.any() and _saw_is_met(track, drive):
        sampled = _nuisance("ripple", "1", "linear", 1.0, SAMPLED)
        slots.append(replace(sampled, low=-1.0, high=1.0))
    if drive.cascade is not None and drive.cascade.k_int.value:
        k_int = drive.cascade.k_int
        tolerance = math.inf if k_int.free else k_int.tolerance
        slots.append(_nuisance("k_int", "1", "log", 1.0, tolerance))
    if np.any(np.asarray(track.track.ext)):
        free = _nuisance("push_gain", "1", "linear", 1.0, math.inf)
        slots.append(replace(free, nominal=1.0))
    return slots


def _saw_is_met(track: JointTrack, drive: JointDrive) -> bool:
    """Whether a target is mostly reached before the next: the command is then a saw.

    Without a low-pass, or behind one that goes most of a way within the period T of the
    targets, 1 − exp(−2π f T) > 1 − 1/e.
    """
    path = drive.effects.get("lowpass_cutoff")
    if not path:
        return True
    gaps = np.diff(np.asarray(track.track.sent), axis=1)
    apart = gaps[gaps > 0.0]
    period_s = track.dt * float(np.median(apart)) if apart.size else 0.0
    return 2.0 * math.pi * path["cutoff_hz"].value * period_s > 1.0


def _nuisance(name: str, unit: str, kind: Kind, scale: float, tolerance: float) -> Slot:
    sigma = SIGMA * tolerance
    return Slot(NUISANCE, name, unit, kind, scale, 0.0, -10.0, 10.0, sigma, (), False)


def _nominal(drive: JointDrive, effect: str, track: JointTrack) -> dict[str, Nominal]:
    """Returns the nominal values that the simulation has of an effect."""
    if effect == "stiffness":
        return {"scale": replace(drive.kp, value=1.0)}
    if effect == "damping":
        return {"scale": replace(drive.kd, value=1.0)}
    found, masses = drive.effects.get(effect, {}), drive.masses.tolerance
    if effect == "armature" and not found:
        # Masses scale all of it; drive and links may be wrong in opposite ways.
        known = math.sqrt(2.0) * track.armature
        inertia = known or float(np.mean(np.asarray(track.track.inertia)))
        return {"inertia_kgm2": Nominal(0.0, masses * inertia)}
    if effect == "payload_mass" and not found:
        carried = float(np.mean(track.track.payload_kg))
        return {"mass_kg": Nominal(0.0, masses * carried)}
    if effect == "encoder_offset" and not found and not track.slide:
        return {"offset_rad": Nominal(0.0, ZERO_RAD)}
    return found


def _sizes(track: JointTrack) -> dict[str, float]:
    """Returns a size that matters for every unit."""
    torque, speed, angle = track.torque_scale, track.speed_scale, track.angle_scale
    inertia = max(float(np.mean(np.asarray(track.track.inertia))), 1e-12)
    squared = float(np.mean(np.asarray(track.track.payload_inertia)))
    carried = {"kg": inertia / squared, "m": 0.2 * squared**0.5} if squared else {}
    return carried | {
        "N·m": torque,
        "rad": 0.1 * angle,
        "rad/s": speed,
        "rad/s²": speed / 0.1,
        "N·m·s/rad": torque / speed,
        "kg·m²": inertia,
        "N·m/s": torque / 0.03,
        "1/(N·m)": 1.0 / torque,
        "1/(N·m)²": 1.0 / torque**2,
        "rad/(N·m)": 0.05 * angle / torque,
        "N·m/rad": torque / angle,
        "s": 0.02,
    }


def _slot(effect: str, name: str, parameter: Parameter, size: float | None) -> Slot:
    """Makes the coordinate of one parameter, fixed at the effect's identity.

    Args:
        effect: name of the effect.
        name: of the parameter.
        parameter: with prior and identity.
        size: that matters in these records; None for units without one.
    """
    identity = parameter.identity
    if identity is None:
        slot = _shape(effect, name, parameter, size)
    elif math.isinf(identity):
        scale = size if size is not None else parameter.prior.center
        starts = _RECIPROCAL.get(parameter.unit, (0.1, 0.3, 1.0, 2.0))
        high = max(50.0, 1.25 * max(starts))
        slot = Slot(effect, name, parameter.unit, "reciprocal", scale, 0.0, 0.0, high,
                    0.0, starts, True)  # fmt: skip
    elif identity == 1.0:
        slot = Slot(effect, name, parameter.unit, "log", 1.0, 0.0, -4.0, 4.0, 0.0,
                    (-0.3, -0.05, 0.05, 0.3), True)  # fmt: skip
    else:
        slot = _linear(effect, name, parameter, size)
    if effect == "command_quantization":
        slot = replace(slot, many_optima=True, starts=_STEP_RANGE)
    return slot


def _shape(effect: str, name: str, parameter: Parameter, size: float | None) -> Slot:
    """A parameter that only shapes its effect: any positive value."""
    prior = parameter.prior
    scale = prior.center
    if size is not None and parameter.unit != "s":
        scale = 0.1 * size
    spread = math.log(prior.spread)
    reach, some = 3.0 * spread + 2.0, 1.2 * spread
    return Slot(effect, name, parameter.unit, "log", scale, 0.0, -reach, reach, 0.0,
                (-some, 0.0, some), True)  # fmt: skip


def _linear(effect: str, name: str, parameter: Parameter, size: float | None) -> Slot:
    """A size of its effect, which vanishes at zero."""
    prior, scale = parameter.prior, size
    if scale is None:
        scale = prior.spread if prior.kind == "normal" else prior.center
    signed = parameter.low < 0.0
    grid = _GRIDS.get(parameter.unit, (0.1,)) if size is not None else (0.5,)
    starts = (0.1, 0.01, -0.01, -0.1) if signed else grid
    low = -30.0 if signed else 0.0
    return Slot(effect, name, parameter.unit, "linear", scale, 0.0, low, 30.0, 0.0,
                starts, True)  # fmt: skip


def _bounded(slot: Slot, parameter: Parameter) -> Slot:
    """Keeps a coordinate within the range of its parameter, where that has no size.

    Torques, masses, angles and speeds are bounded by what occurs in the records alone.
    """
    if slot.unit not in UNIVERSAL:
        return slot
    if slot.kind == "reciprocal":
        return replace(slot, high=min(slot.high, slot.coordinate(parameter.low)))
    ends = [slot.coordinate(x) if x != 0.0 or slot.kind == "linear" else slot.low
            for x in (parameter.low, parameter.high)]  # fmt: skip
    return replace(slot, low=max(slot.low, ends[0]), high=min(slot.high, ends[1]))


def _with_prior(slot: Slot, known: Nominal) -> Slot:
    """Places a coordinate at its nominal value, with the prior of its tolerance."""
    absent = known.value == 0.0 and slot.kind == "linear"
    nominal = slot.coordinate(known.value)
    if slot.kind == "log":
        tolerance = known.tolerance
    elif absent:
        tolerance = known.tolerance / slot.scale
    else:
        tolerance = known.tolerance * abs(nominal)
    if slot.unit == "s":
        tolerance = max(tolerance, DELAY_S / slot.scale)
    starts = slot.starts
    if slot.kind != "log" and not absent:
        near = (0.5 * nominal, 0.8 * nominal, 1.25 * nominal, 2.0 * nominal)
        beyond = starts if slot.unit == "s" else [u for u in starts if u > nominal]
        starts = (*near, *beyond)
    low = min(slot.low, -0.8) if slot.effect == "armature" else slot.low
    if slot.kind != "log" and slot.unit not in UNIVERSAL:
        # What the drive file says may be far from what occurs in these records.
        slot = replace(slot, high=max(slot.high, 2.0 * abs(nominal)))
        low = min(low, -2.0 * abs(nominal)) if low < 0.0 else low
    return replace(
        slot,
        nominal=nominal,
        low=low,
        prior_sd=math.inf if known.free else SIGMA * tolerance,
        starts=starts,
        vanishes=absent or slot.effect in ("stiffness", "damping"),
    )
