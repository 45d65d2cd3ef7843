"""Names become indices once: where each signal stands in the sensor vector."""

from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Array, Float

from envs.errors import InputError
from envs.hand.model import PALM, PAYLOAD
from envs.hand.nominal import FINGERS, vendor_hand

TIP_SITES = tuple(f"{finger}_tip" for finger in FINGERS)
TIP_LINKS = tuple(link.body for link in vendor_hand().links if link.tip)
TIP_SPHERES = tuple(f"{link}_tip" for link in TIP_LINKS)
OTHER_LINKS = tuple(
    link.body for link in vendor_hand().links if link.capsule and not link.tip
)
HAND_NQ, HAND_NV = 27, 26
"""Positions and velocities of the hand, which come first in every scene."""
JOINT_QPOS, JOINT_QVEL = slice(7, HAND_NQ), slice(6, HAND_NV)
"""Where its joints stand in them, after the free root."""


@dataclass(frozen=True)
class HandSpec:
    """Indices into one model of the hand.

    Attributes:
        sensors: sensor name to its slice of `sensordata`.
        palm_body, payload_body: body ids.
        tip_geoms: geom ids of the five fingertips, spheres and capsules.
        joint_range_rad: limits of the 20 joints (20 × 2).
    """

    sensors: dict[str, slice]
    palm_body: int
    payload_body: int
    tip_geoms: tuple[int, ...]
    joint_range_rad: np.ndarray

    def read(self, sensordata: Float[Array, " n"], name: str) -> Float[Array, " m"]:
        """One sensor's values: x = sensordata[adr : adr + dim] [N, N·m, m, m/s, 1].

        Args:
            sensordata: all sensors, each in its own unit.
            name: of the sensor, `<quantity>_<object>`.

        Source:
            MuJoCo documentation, `mjData.sensordata`.
        """
        return sensordata[self.sensors[name]]


def hand_spec(model: mujoco.MjModel) -> HandSpec:
    """Resolves all names in a model of the hand, alone or first in a scene.

    Raises:
        InputError: the joints of the hand are not the first ones of the model.
    """
    names = vendor_hand().joint_names
    joints = [model.joint(name).id for name in names]
    found = (model.jnt_qposadr[joints], model.jnt_dofadr[joints])
    wanted = (np.arange(HAND_NQ)[JOINT_QPOS], np.arange(HAND_NV)[JOINT_QVEL])
    if not all(np.array_equal(a, b) for a, b in zip(found, wanted, strict=True)):
        valid = "the hand first, bodies of the task after it"
        raise InputError("scene", "joints", found[0].tolist(), valid)
    ends = model.sensor_adr + model.sensor_dim
    return HandSpec(
        sensors={
            model.sensor(i).name: slice(int(model.sensor_adr[i]), int(ends[i]))
            for i in range(model.nsensor)
        },
        palm_body=model.body(PALM).id,
        payload_body=model.body(PAYLOAD).id,
        tip_geoms=tuple(model.geom(name).id for name in TIP_SPHERES + TIP_LINKS),
        joint_range_rad=model.jnt_range[joints],
    )
