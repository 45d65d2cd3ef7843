"""What effects need in the scene: room for friction, pairs with the floor, sensors."""

from __future__ import annotations

from typing import TYPE_CHECKING

import mujoco

from envs.hand.hand_file import HandFile

if TYPE_CHECKING:
    from envs.actuator.effect import EffectKind

SLIGHT_FRICTION_NM = 1e-6
"""A friction that is there, so that a world may have more: MJX plans its constraints
by the nominal model."""


def kinds_of(hand: HandFile) -> tuple[EffectKind, ...]:
    """Returns the kinds of effects that a hand has, in the order of the catalogue.

    The catalogue loads JAX, for which a hand without effects does not wait.
    """
    if not hand.effects:
        return ()
    from envs.actuator.catalogue import CATALOGUE

    names = {effect.name for effect in hand.effects}
    return tuple(kind for name, kind in CATALOGUE.items() if name in names)


def load_sensor(joint: str) -> str:
    """Name of the sensor of the torque that the links put on a joint."""
    return f"load_{joint}"


def pair_name(finger: str) -> str:
    """Name of the contact pair of a fingertip and the floor."""
    return f"{finger}_floor"


def add_effect_parts(spec: mujoco.MjSpec, hand: HandFile, floor: str) -> None:
    """Adds to a scene what the effects of the hand need, and nothing without effects.

    Args:
        spec: the scene with floor and hand.
        hand: the hand file.
        floor: name of the floor's geom.
    """
    if not hand.effects:
        return
    from envs.actuator.effect import Stage

    kinds = kinds_of(hand)
    if any(Stage.FRICTION in kind.acts for kind in kinds):
        for name in hand.nominal.joint_names:
            spec.joint(name).frictionloss = SLIGHT_FRICTION_NM
    if any(kind.uses_load for kind in kinds):
        _add_load_sensors(spec, hand)
    if any(kind.name == "friction_anisotropy" for kind in kinds):
        _add_pairs(spec, hand, floor)


def friction_rows(model: mujoco.MjModel) -> int:
    """Constraint rows that dry friction takes in each world."""
    return int((model.dof_frictionloss > 0.0).sum())


def _add_load_sensors(spec: mujoco.MjSpec, hand: HandFile) -> None:
    """Adds the torque between each link and its parent, in the frame of the joint."""
    for link in hand.nominal.links:
        spec.body(link.body).add_site(name=load_sensor(link.joint))
        spec.add_sensor(
            name=load_sensor(link.joint),
            type=mujoco.mjtSensor.mjSENS_TORQUE,
            objtype=mujoco.mjtObj.mjOBJ_SITE,
            objname=load_sensor(link.joint),
        )


def _add_pairs(spec: mujoco.MjSpec, hand: HandFile, floor: str) -> None:
    """Puts explicit pairs in the place of the contacts of fingertips and floor."""
    nominal = hand.nominal
    for finger, link in zip(nominal.fingers, nominal.tip_links, strict=True):
        sphere = spec.geom(f"{link.body}_tip")
        sphere.conaffinity = 0
        slide, spin, roll = sphere.friction
        spec.add_pair(
            name=pair_name(finger),
            geomname1=floor,
            geomname2=sphere.name,
            condim=3,
            friction=[slide, slide, spin, roll, roll],
        )
