"""Effects of the whole hand: what they change in the physics model and in the IMU."""

from dataclasses import dataclass
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from envs.actuator.catalogue import CATALOGUE
from envs.actuator.effect import EffectKind, Params
from envs.actuator.effects.floor_tilt import GRAVITY
from envs.actuator.surroundings import Imu, Scene
from envs.errors import InputError
from envs.hand.drive.chain import float32, joint_params
from envs.hand.effect_parts import kinds_of, pair_name
from envs.hand.hand_file import HandFile
from envs.hand.places import fingers_at
from envs.hand.spec import HandSpec
from envs.physics.base import ModelFields, nominal_field
from envs.physics.quiet_mujoco import mujoco

EffectParams = dict[str, Params]
"""Parameters by effect name."""


@dataclass(frozen=True)
class SceneEffects:
    """The effects of a hand that act by its physics model or its IMU.

    Attributes:
        scene: where the effects find their places.
        params: parameters by effect name; may be traced, so that one program runs many
            candidates: `dataclasses.replace(effects, params=…)` under `vmap`.
    """

    scene: Scene
    params: EffectParams

    def change(self, fields: ModelFields) -> ModelFields:
        """Returns the fields of a world with the effects in them."""
        for kind, params in self._of("changes_model"):
            fields = dict(kind.changes_model(params, self.scene, self._whole(fields)))
        return fields

    def sense(self, imu: Imu) -> Imu:
        """Returns what the IMU measures."""
        for kind, params in self._of("senses"):
            imu = kind.senses(params, imu)
        return imu

    @property
    def down_w(self) -> Float[Array, "3"]:
        """Unit vector of gravity in the world, whose z is the floor's normal."""
        if "floor_tilt" not in self.params:
            return jnp.array([0.0, 0.0, -1.0])
        kind, given = CATALOGUE["floor_tilt"], self._whole({})
        assert kind.changes_model is not None
        gravity = kind.changes_model(self.params[kind.name], self.scene, given)[GRAVITY]
        return gravity / jnp.sqrt(jnp.sum(gravity**2))

    def _of(self, part: str) -> list[tuple[Any, Params]]:
        kinds = [CATALOGUE[name] for name in CATALOGUE if name in self.params]
        return [(k, self.params[k.name]) for k in kinds if getattr(k, part) is not None]

    def _whole(self, fields: ModelFields) -> "_Whole":
        return _Whole(fields, self.scene.nominal)


class _Whole(dict):
    """Model fields that are nominal where they are not given."""

    def __init__(self, fields: ModelFields, nominal: Any):
        super().__init__(fields)
        self._nominal = nominal

    def __missing__(self, name: str) -> Array:
        return jnp.asarray(nominal_field(self._nominal, name), jnp.float32)


def make_scene_effects(
    hand: HandFile, model: mujoco.MjModel, spec: HandSpec
) -> SceneEffects:
    """Finds the places of the hand's effects in a model.

    Raises:
        InputError: an effect that a hand that stands free cannot have, or a payload
            without mass.
    """
    params = {}
    for kind in kinds_of(hand):
        if kind.changes_model is not None or kind.senses is not None:
            params[kind.name] = float32(_params(hand, kind))
        elif kind.name == "mount_tilt":
            valid = "effects of a hand without a mount; a tilted floor is floor_tilt"
            raise InputError("hand file", "effects", kind.name, valid)
    _check_payload(hand, params)
    return SceneEffects(_scene(model, spec), params)


def _params(hand: HandFile, kind: EffectKind) -> dict[str, np.ndarray]:
    """Parameters of an effect: per joint, per finger, or for the hand."""
    if kind.scope == "joint":
        return joint_params(hand, kind.name)
    entries = [effect for effect in hand.effects if effect.name == kind.name]
    if kind.scope == "hand":
        (entry,) = entries
        return {k: np.array(q.value) for k, q in entry.parameters.items()}
    count = len(hand.nominal.fingers)
    found = {k: np.full(count, v) for k, v in kind.identity().items()}
    for entry in entries:
        for key, quantity in entry.parameters.items():
            found[key][list(fingers_at(hand.nominal, entry.where))] = quantity.value
    return found


def _check_payload(hand: HandFile, params: EffectParams) -> None:
    added = params.get("payload_mass")
    if added is not None and hand.payload_mass.value + added["mass_kg"] <= 0.0:
        found = float(added["mass_kg"])
        valid = f"more than −{hand.payload_mass.value:g} kg, the mass of the payload"
        raise InputError("hand file", "effects: payload_mass.mass_kg", found, valid)


def _scene(model: mujoco.MjModel, spec: HandSpec) -> Scene:
    count = len(spec.fingers)
    spheres, links = spec.tip_geoms[:count], spec.tip_geoms[count:]
    pairs = [model.pair(i).name for i in range(model.npair)]
    return Scene(
        nominal=model,
        payload_body=spec.payload_body,
        above_payload=(0, spec.palm_body, spec.payload_body),
        tip_geoms=tuple(zip(spheres, links, strict=True)),
        tip_pairs=tuple(
            pairs.index(pair_name(f)) for f in spec.fingers if pair_name(f) in pairs
        ),
    )
