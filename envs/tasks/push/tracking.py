"""From camera samples to the pushing policy's inputs, as the deployment shim does it.

`fingers_robot.behaviour.tracking` is the same in NumPy; a test compares them.
"""

import flax.struct
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from envs.tasks.push.camera import Frame

VELOCITY_TIME_S = 0.15
"""Time constant τ of the velocity estimate [s]; ours."""


@flax.struct.dataclass
class Track:
    """What is known of hand and object.

    Attributes:
        frame: the newest sample.
        slow_pos_w: low-passed position of the object [m].
    """

    frame: Frame
    slow_pos_w: Float[Array, "*b 3"]


def start_track(frame: Frame) -> Track:
    """Begins with an object at rest."""
    return Track(frame, frame.object_pos_w)


def step_track(track: Track, frame: Frame) -> Track:
    """Takes in a sample; one that was seen before changes nothing.

    s ← s + (1 − e^{−Δt/τ}) (p − s), with the time Δt between exposures.
    """
    passed_s = frame.t_s - track.frame.t_s
    share = 1.0 - jnp.exp(-passed_s / VELOCITY_TIME_S)
    slow = track.slow_pos_w + share * (frame.object_pos_w - track.slow_pos_w)
    new = Track(frame, slow)
    return jax.tree.map(lambda a, b: jnp.where(passed_s > 0.0, a, b), new, track)


def track_inputs(
    track: Track, target_pos_w: Float[Array, "3"], gravity_v: Float[Array, "3"]
) -> dict[str, Float[Array, "3"]]:
    """Object position, velocity and way to the target in V.

    The velocity is v = (p − s)/τ, which for a steady motion is the velocity itself,
    with noise of about σ/τ. V's tilt is that of the IMU, its heading that of the
    camera.

    Args:
        track: what is known.
        target_pos_w: the target [m].
        gravity_v: unit vector of gravity in V, as the IMU measures it.

    Returns:
        `object_pos` [m], `object_vel` [m/s], `object_to_target` [m].

    Source:
        Paper, object pushing; the velocity filter is ours.
    """
    frame = track.frame
    vel_w = (frame.object_pos_w - track.slow_pos_w) / VELOCITY_TIME_S

    def in_v(vector_w: Float[Array, "3"]) -> Float[Array, "3"]:
        return to_v(vector_w, frame.heading_rad, gravity_v)

    return {
        "object_pos": in_v(frame.object_pos_w - frame.root_pos_w),
        "object_vel": in_v(vel_w),
        "object_to_target": in_v(target_pos_w - frame.object_pos_w),
    }


def to_v(
    vector_w: Float[Array, "3"],
    heading_rad: Float[Array, ""],
    gravity_v: Float[Array, "3"],
) -> Float[Array, "3"]:
    """World components of a vector as components in V.

    x_V = (x cos ψ + y sin ψ) a + (y cos ψ − x sin ψ) (u × a) + z u, with u = −g up and
    a the part of V's x axis across u, of length 1.

    Args:
        vector_w: the vector, of any unit, which is that of the result.
        heading_rad: ψ, angle about the vertical of V's x axis, seen from above [rad].
        gravity_v: g, unit vector of gravity in V.

    Source:
        Ours.
    """
    up = -gravity_v
    ahead = jnp.array([1.0, 0.0, 0.0]) - up[0] * up
    ahead = ahead / jnp.sqrt(jnp.sum(ahead**2))
    beside = jnp.cross(up, ahead)
    cos, sin = jnp.cos(heading_rad), jnp.sin(heading_rad)
    x, y, z = vector_w
    return (cos * x + sin * y) * ahead + (cos * y - sin * x) * beside + z * up
