"""The hand model file with what a diagnosis found in it, ready to train on."""

import dataclasses

import numpy as np

from envs.hand.hand_file import Effect, HandFile, JointQuantity, Quantity
from sysid.diagnosis import Cause, Diagnosis, Estimate
from sysid.mechanism import Mechanism, hand_mechanism

_FIGURES = {
    "transport_delay": ("delay_s", "delay_s"),
    "lowpass_cutoff": ("lowpass_hz", "cutoff_hz"),
}
_PER_JOINT = {
    "stiffness": ("stiffness_scale", "scale"),
    "damping": ("damping_scale", "scale"),
    "slew_limit": ("speed_limit", "speed_rad_s"),
    "torque_limit": ("torque_scale", "limit_nm"),
}


def extended_hand(hand: HandFile, diagnosis: Diagnosis) -> HandFile:
    """Returns the hand with the causes: figures replaced, other effects added.

    Args:
        hand: the hand file of the simulation that was compared.
        diagnosis: with the causes.

    Raises:
        InputError: an estimate outside of what a hand file may hold.
    """
    source = f"identified from {diagnosis.log_sha256[0]}"
    mechanism = hand_mechanism(hand)
    for cause in diagnosis.causes:
        hand = _with_cause(hand, cause, mechanism, source)
    return hand


def _with_cause(
    hand: HandFile, cause: Cause, mechanism: Mechanism, source: str
) -> HandFile:
    """Adds one cause."""
    if cause.effect in _FIGURES and cause.where == "all":
        name, parameter = _FIGURES[cause.effect]
        figure = _quantity(cause.parameters[parameter], source)
        return dataclasses.replace(hand, **{name: figure})
    if cause.effect in _PER_JOINT:
        return _scaled(hand, cause, mechanism, source)
    found = {k: _quantity(v, source) for k, v in cause.parameters.items()}
    added = Effect(cause.effect, found, (cause.where,))
    return dataclasses.replace(hand, effects=(*hand.effects, added))


def _scaled(
    hand: HandFile, cause: Cause, mechanism: Mechanism, source: str
) -> HandFile:
    """Changes a figure that every joint has of its own."""
    name, parameter = _PER_JOINT[cause.effect]
    old: JointQuantity = getattr(hand, name)
    estimate = cause.parameters[parameter]
    values = old.per_joint()
    joints = list(mechanism.joints)
    named = mechanism.classes.get(cause.where, (cause.where,))
    at = joints if cause.where == "all" else [j for j in joints if j in named]
    for joint in at:
        i = joints.index(joint)
        if cause.effect == "slew_limit":
            values[i] = estimate.value
        elif cause.effect == "torque_limit":
            limit = mechanism.drives[joint].effects["torque_limit"]["limit_nm"].value
            values[i] *= estimate.value / limit
        else:
            values[i] *= estimate.value
    new = JointQuantity(
        value=tuple(np.asarray(values, float).tolist()),
        unit=old.unit,
        source=source,
        note=f"{cause.effect} of {cause.where}",
    )
    return dataclasses.replace(hand, **{name: new})


def _quantity(estimate: Estimate, source: str) -> Quantity:
    """Returns an estimate as a figure of a hand file."""
    value, low, high = estimate.value, estimate.low, estimate.high
    return Quantity(value, estimate.unit, source, min(low, value), max(high, value))
