"""What effects must know beside their own joint: neighbours, gravity, scene, IMU."""

from dataclasses import dataclass
from typing import Any

import flax.struct
from jaxtyping import Array, Float


@flax.struct.dataclass
class Gravity:
    """Gravity's torques at the present angles, from the caller's kinematics.

    The torque of gravity g on joint i is m_i · g, with the moment m_i of all masses
    that the joint carries: for a mass at r from a joint with axis a, m = mass (a × r).

    Attributes:
        gravity: gravity in the frame of the mount [m/s²]; (0, 0, −9.81) if level.
        moment: m of each joint in that frame [kg·m].
        payload_kg: nominal mass of the payload.
        payload_moment: m of a payload of 1 kg [m].
        payload_shift: change of `payload_moment` by a shift of the payload along the
            x, y and z of the body that carries it [m/m]: rows a × e_k.
        payload_inertia: inertia about the joint of a payload of 1 kg that is spread as
            the nominal one is [m²].
        payload_push: torque on the joint by a payload of 1 kg that the motion of the
            other joints accelerates [m²/s²].
    """

    gravity: Float[Array, "*j 3"]
    moment: Float[Array, "*j 3"]
    payload_kg: Float[Array, "*j"]
    payload_moment: Float[Array, "*j 3"]
    payload_shift: Float[Array, "*j 3 3"]
    payload_inertia: Float[Array, "*j"]
    payload_push: Float[Array, "*j"]


@flax.struct.dataclass
class Surroundings:
    """What the rest of the hand does in a substep; what nobody needs may be left out.

    Attributes:
        others_nm: sum of the other joints' |effort| on the same supply [N·m];
            none for a joint alone.
        other_q: angle of the joint that is coupled to this one [rad].
        other_nm: effort of that joint [N·m].
        gravity: gravity's torques.
        inertia: what of the joint's inertia may turn with the motor [kg·m²].
    """

    others_nm: Float[Array, "*j"] | float | None = None
    other_q: Float[Array, "*j"] | None = None
    other_nm: Float[Array, "*j"] | None = None
    gravity: Gravity | None = None
    inertia: Float[Array, "*j"] | float | None = None


ALONE = Surroundings()


@dataclass(frozen=True)
class Scene:
    """Where an effect finds its places in the physics model of the whole hand.

    Attributes:
        nominal: the `mujoco.MjModel` whose fields are changed.
        payload_body: body id of the module on the back.
        above_payload: ids of the bodies whose subtree holds the payload, and its own.
        tip_geoms: geom ids of sphere and capsule of the five fingertips (5 × 2).
        tip_pairs: contact pairs of the five tips with the floor; none in a model
            whose contacts have friction alike in all directions.
    """

    nominal: Any
    payload_body: int
    above_payload: tuple[int, ...]
    tip_geoms: tuple[tuple[int, int], ...]
    tip_pairs: tuple[int, ...] = ()


@flax.struct.dataclass
class Imu:
    """What an IMU measures, in its own frame, nominally the palm's.

    Attributes:
        gravity: unit vector of gravity, which points down.
        angvel: angular velocity [rad/s].
    """

    gravity: Float[Array, "3"]
    angvel: Float[Array, "3"]
