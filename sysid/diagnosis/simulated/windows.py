"""Records cut into windows that a simulation runs through side by side."""

from dataclasses import replace

import flax.struct
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from sysid.diagnosis.replay import band
from sysid.diagnosis.replay.motion import Motion, Track, motion_of


@flax.struct.dataclass
class Windows:
    """The motion at the end and start of steps, in windows side by side, and targets.

    Attributes:
        motion, before: at the end and at the start of the steps.
        target: in the parts of the steps [rad].
        resumed: where the record resumes [1].
        number: of the steps, in every window.
        whole: the motion before it is cut.
        track: with the gains and loads of every window.
    """

    motion: Motion
    before: Motion
    target: Float[Array, "w k l c"]
    resumed: Float[Array, "w l"]
    number: Float[Array, "w n"]
    whole: Motion
    track: Track


def cut_windows(
    track: Track,
    target: Float[Array, "t k p c"],
    window: int,
    dt: float,
) -> Windows:
    """Cuts all along time into windows and lays them side by side.

    Args:
        track: of the joint.
        target: mean targets of the parts of its steps [rad].
        window: length of a window; the last one is filled with the last step [steps].
        dt: step of the grid [s].
    """
    steps = len(track.pos)
    number = -(-steps // window)
    tail = number * window - steps

    def cut(x):
        wide = jnp.pad(x, [(0, tail)] + [(0, 0)] * (x.ndim - 1), "edge")
        parts = wide.reshape(number, window, *x.shape[1:])
        return jnp.swapaxes(parts, 0, 1).reshape(window, -1, *x.shape[2:])

    moved = jnp.swapaxes(target, 1, 2)
    aside = jnp.swapaxes(cut(moved), 1, 2)
    constants = {
        name: jnp.concatenate([getattr(track, name)] * number)
        for name in ("gravity", "payload_kg", "kp", "kd")
    }
    motion = motion_of(track)
    motion = replace(motion, push=band.sharpened(motion.push))
    before = jax.tree.map(cut, _before(motion, dt))
    starts = jnp.arange(number) * window
    count = (jnp.arange(window)[:, None] + starts).astype(track.pos.dtype)
    track = replace(track, **constants)
    rows = jax.tree.map(cut, motion), before, aside, cut(track.resumed), count
    return Windows(*rows, motion, track)


def _before(motion: Motion, dt: float) -> Motion:
    """Returns the motion one step earlier; before the first row, as that moves."""
    shifted = jax.tree.map(lambda v: jnp.concatenate([v[:1], v[:-1]]), motion)
    pos, vel, acc = motion.pos[0], motion.vel[0], motion.acc[0]
    return replace(
        shifted,
        pos=shifted.pos.at[0].set(pos - dt * vel + 0.5 * dt**2 * acc),
        vel=shifted.vel.at[0].set(vel - dt * acc),
    )
