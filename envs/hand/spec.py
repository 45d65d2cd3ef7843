"""Names become indices once: where each signal stands in the sensor vector."""

import re
from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Array, Float

from envs.errors import InputError
from envs.hand.model import PALM, PAYLOAD
from envs.hand.nominal import FINGERS

_JOINT = re.compile(r"finger(\d+)_joint(\d+)")


@dataclass(frozen=True)
class HandSpec:
    """Indices into one model of the hand.

    Attributes:
        sensors: sensor name to its slice of `sensordata`.
        palm_body, payload_body: body ids.
        tip_geoms: geom ids of the fingertips, spheres and capsules.
        joint_range_rad: limits of the joints (n × 2).
        joints: names of the joints, finger by finger.
        fingers: names of the fingers.
        tip_links: bodies of the fingertips.
        other_links: the other links that have a capsule.
    """

    sensors: dict[str, slice]
    palm_body: int
    payload_body: int
    tip_geoms: tuple[int, ...]
    joint_range_rad: np.ndarray
    joints: tuple[str, ...]
    fingers: tuple[str, ...]
    tip_links: tuple[str, ...]
    other_links: tuple[str, ...]

    @property
    def nq(self) -> int:
        """Positions of the hand, which come first in every scene."""
        return 7 + len(self.joints)

    @property
    def nv(self) -> int:
        """Velocities of the hand, likewise."""
        return 6 + len(self.joints)

    @property
    def joint_qpos(self) -> slice:
        """Where the joints stand among the positions, after the free root."""
        return slice(7, self.nq)

    @property
    def joint_qvel(self) -> slice:
        """Where they stand among the velocities."""
        return slice(6, self.nv)

    @property
    def tip_sites(self) -> tuple[str, ...]:
        """Names of the sites at the centres of the fingertips."""
        return tuple(f"{finger}_tip" for finger in self.fingers)

    @property
    def tip_spheres(self) -> tuple[str, ...]:
        """Names of the geoms with which they meet the floor."""
        return tuple(f"{link}_tip" for link in self.tip_links)

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
    """Resolves all names in a model of a hand, alone or first in a scene.

    Raises:
        InputError: the joints of the hand are not the first ones of the model.
    """
    listed = [model.joint(i).name for i in range(model.njnt)]
    names = tuple(name for name in listed if _JOINT.fullmatch(name))
    joints = [model.joint(name).id for name in names]
    found = (model.jnt_qposadr[joints], model.jnt_dofadr[joints])
    count = np.arange(len(names))
    if not all(
        np.array_equal(a, b + count) for a, b in zip(found, (7, 6), strict=True)
    ):
        valid = "the hand first, bodies of the task after it"
        raise InputError("scene", "joints", found[0].tolist(), valid)
    tips, others = _capsules(model, names)
    ends = model.sensor_adr + model.sensor_dim
    return HandSpec(
        sensors={
            model.sensor(i).name: slice(int(model.sensor_adr[i]), int(ends[i]))
            for i in range(model.nsensor)
        },
        palm_body=model.body(PALM).id,
        payload_body=model.body(PAYLOAD).id,
        tip_geoms=tuple(
            model.geom(name).id for name in (*(f"{n}_tip" for n in tips), *tips)
        ),
        joint_range_rad=model.jnt_range[joints],
        joints=names,
        fingers=FINGERS[: len(tips)],
        tip_links=tips,
        other_links=others,
    )


def _capsules(
    model: mujoco.MjModel, joints: tuple[str, ...]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Links that are fingertips, and the others that have a capsule."""
    geoms = {model.geom(i).name for i in range(model.ngeom)}
    links = [name.replace("joint", "link") for name in joints]
    tips = tuple(link for link in links if f"{link}_tip" in geoms)
    return tips, tuple(link for link in links if link in geoms and link not in tips)
