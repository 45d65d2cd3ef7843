"""Effects of the catalogue as they act along a measured motion.

Beside them stand five that only the replay has: friction at the smoothed speed, the
supply's sag under measured torques, the servo at the measured angle, the measured
effort that enters the gears, and the integral of a cascade.
"""

import dataclasses
from collections.abc import Mapping

import jax.numpy as jnp

from envs.actuator.catalogue import CATALOGUE
from envs.actuator.effect import EffectKind, Params, Stage
from sysid.diagnosis.replay import cascade, command, link
from sysid.diagnosis.replay.torque_slope import SLOPE

WALKING = ("finger_weakness",)
"""Effects on joints that only records of a walking hand distinguish from others."""


def joint_effects() -> tuple[str, ...]:
    """Returns the effects of the catalogue that a joint can have, in their order."""
    return tuple(n for n, kind in CATALOGUE.items() if kind.acts and n not in WALKING)


def _replay_only(name: str, acts: Mapping[Stage, object], init=None) -> EffectKind:
    extra = {"init": init} if init else {}
    return EffectKind(name, "", {}, acts, {}, "", **extra)  # pyright: ignore


def _slow(params: Params, state, x, dt):
    """Friction acts at the speed without the noise of differentiation."""
    return state, x.replace(qd=params["slow_vel"])


def _sag(params: Params, state, x, dt):
    """Divides the torque by what all joints ask for, where the others' is measured.

    Of the others' demands d the measured torques are V d, so V = 1 / (1 + s (τ + Σ d))
    becomes (1 − s Σ V d) / (1 + s τ).
    """
    sag = params["sag_per_nm"]
    own = 1.0 / (1.0 + sag * jnp.abs(x.torque))
    share = jnp.maximum(1.0 - sag * x.around.others_nm, 0.0) * own
    return state, x.replace(torque=share * x.torque, follows=share * own * x.follows)


def _enter(params: Params, state, x, dt):
    """Keeps the servo's torque as state and lets the measured one enter the gears."""
    mixed = x.torque + params["measured"] * (params["effort"] - x.torque)
    return x.torque, x.replace(torque=mixed + x.follows * x.kp * params["ripple"])


def _read(params: Params, state, x, dt):
    """Keeps the modelled encoder reading as state; the servo acts on the measured."""
    measured = x.replace(encoder=params["angle"], encoder_speed=params["speed"])
    return (x.encoder, x.encoder_speed), measured


READ = _replay_only(
    "measured_angle",
    {Stage.ENCODER: _read},
    lambda params, target, q, dt: (jnp.zeros_like(q), jnp.zeros_like(q)),
)
SLOW = _replay_only("slow_speed", {Stage.FRICTION: _slow})
ENTER = _replay_only(
    "measured_effort",
    {Stage.TORQUE: _enter},
    lambda params, target, q, dt: jnp.zeros_like(q),
)
KINDS = {
    name: CATALOGUE[name] for name in joint_effects() if name not in command.EFFECTS
} | {cascade.NAME: cascade.KIND}
"""Effects that act behind the command path, and the part of a cascade that a servo with
two gains lacks."""

_SAG = CATALOGUE["supply_sag"]
RIGID = {n: kind for n, kind in KINDS.items() if n not in link.EFFECTS} | {
    SLOPE.name: SLOPE,
    _SAG.name: dataclasses.replace(_SAG, acts={Stage.TORQUE: _sag}),
}
"""Those that act in front of the link, as they do along a measured motion."""
