"""The hand model file with what a diagnosis found in it, ready to train on."""

import dataclasses
from collections.abc import Callable

import numpy as np

from envs.actuator.catalogue import CATALOGUE
from envs.hand.hand_file import Effect, HandFile
from envs.hand.quantity import JointQuantity, Quantity
from sysid.mechanism import Mechanism, hand_mechanism
from sysid.result import Cause, Diagnosis, Estimate

_WHOLE_HAND = {
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
    """Returns the hand with the causes: nominal values replaced, other effects added.

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
    if cause.effect in _WHOLE_HAND and cause.where == "all":
        name, parameter = _WHOLE_HAND[cause.effect]
        quantity = _quantity(cause.parameters[parameter], source)
        return dataclasses.replace(hand, **{name: quantity})
    if cause.effect in _PER_JOINT:
        return _scaled(hand, cause, mechanism, source)
    found = {
        name: _within(cause.effect, name, _beside(hand, cause.effect, value), source)
        for name, value in cause.parameters.items()
    }
    whole = CATALOGUE[cause.effect].scope == "hand"
    if whole and cause.effect in (effect.name for effect in hand.effects):
        return hand  # added by the joint that shows it best
    where = "all" if whole else cause.where
    added = Effect(cause.effect, found, (where,), cause.other)
    return dataclasses.replace(hand, effects=(*hand.effects, added))


def _beside(hand: HandFile, effect: str, estimate: Estimate) -> Estimate:
    """Returns what a delay or filter of some joints adds to that of the whole hand."""
    if effect == "transport_delay":
        return _changed(estimate, lambda x: x - hand.delay_s.value)
    if effect == "lowpass_cutoff":
        # Time constants of two filters in a row add up, to first order.
        rest = 1.0 / hand.lowpass_hz.value
        return _changed(estimate, lambda x: 1.0 / max(1.0 / x - rest, 1e-9))
    return estimate


def _changed(estimate: Estimate, change: Callable[[float], float]) -> Estimate:
    value, low, high = map(change, (estimate.value, estimate.low, estimate.high))
    return Estimate(value, min(low, high), max(low, high), estimate.unit)


def _within(effect: str, name: str, estimate: Estimate, source: str) -> Quantity:
    """Returns a value within the range that training takes, noted if it was not."""
    parameter = CATALOGUE[effect].parameters[name]

    def clipped(x: float) -> float:
        return min(max(x, parameter.low), parameter.high)

    value, low, high = estimate.value, estimate.low, estimate.high
    note = "" if clipped(value) == value else f"found {value:.6g}, outside of the range"
    return Quantity(
        clipped(value),
        estimate.unit,
        source,
        clipped(min(low, value)),
        clipped(max(high, value)),
        note,
    )


def _scaled(
    hand: HandFile, cause: Cause, mechanism: Mechanism, source: str
) -> HandFile:
    """Changes a value that every joint has of its own."""
    name, parameter = _PER_JOINT[cause.effect]
    old: JointQuantity = getattr(hand, name)
    estimate = cause.parameters[parameter]
    values = hand.per_joint(name)
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
    """Returns an estimate as a quantity of a hand file."""
    value, low, high = estimate.value, estimate.low, estimate.high
    return Quantity(value, estimate.unit, source, min(low, value), max(high, value))
