"""Names become indices once: where each signal stands in the sensor vector."""

from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Array, Float

from envs.hand.figures import FINGERS, figures
from envs.hand.model import PALM, PAYLOAD

TIP_SITES = tuple(f"{finger}_tip" for finger in FINGERS)
TIP_LINKS = tuple(link.body for link in figures().links if link.tip)
TIP_SPHERES = tuple(f"{link}_tip" for link in TIP_LINKS)
OTHER_LINKS = tuple(
    link.body for link in figures().links if link.capsule and not link.tip
)


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
        """One sensor's values."""
        return sensordata[self.sensors[name]]


def hand_spec(model: mujoco.MjModel) -> HandSpec:
    """Resolves all names in a model built by `envs.hand.model`."""
    ends = model.sensor_adr + model.sensor_dim
    return HandSpec(
        sensors={
            model.sensor(i).name: slice(int(model.sensor_adr[i]), int(ends[i]))
            for i in range(model.nsensor)
        },
        palm_body=model.body(PALM).id,
        payload_body=model.body(PAYLOAD).id,
        tip_geoms=tuple(model.geom(name).id for name in TIP_SPHERES + TIP_LINKS),
        joint_range_rad=model.jnt_range[model.jnt_type != mujoco.mjtJoint.mjJNT_FREE],
    )
