"""An overhead camera that tracks hand and object: held, late, lossy and noisy samples.

Frames are taken at 60 Hz beside a control rate of 50 Hz, so that a sample is up to one
frame interval old when the control step reads it, and then one to three control steps
late. A lost frame leaves the one before it in place.
"""

import flax.struct
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, PRNGKeyArray

from envs.config.settings.push import CameraConfig as CameraConfig
from envs.streams import stream

DELAY_LINE = 8
"""Samples that are kept, one per control step: the largest latency is one less."""


@flax.struct.dataclass
class Frame:
    """One sample of the camera.

    Attributes:
        t_s: time of the exposure since the episode's start [s].
        object_pos_w: centre of the object [m].
        root_pos_w: origin of the palm [m].
        heading_rad: angle of V's x axis about the vertical.
    """

    t_s: Float[Array, "*b"]
    object_pos_w: Float[Array, "*b 3"]
    root_pos_w: Float[Array, "*b 3"]
    heading_rad: Float[Array, "*b"]


@flax.struct.dataclass
class CameraState:
    """A camera between two control steps.

    Attributes:
        line: the newest sample of each of the last control steps, oldest first.
        truth: what there was to see at the last control step.
        latency: control steps by which samples are late.
        phase_s: time of the first exposure [s].
    """

    line: Frame
    truth: Frame
    latency: Int[Array, "*b"]
    phase_s: Float[Array, "*b"]


def start_camera(key: PRNGKeyArray, config: CameraConfig, truth: Frame) -> CameraState:
    """A camera that has seen the scene as it is for as long as it looks back.

    Args:
        key: of the episode.
        config: settings.
        truth: what there is to see, at time 0.
    """
    low, high = config.latency_steps
    latency = jax.random.randint(stream(key, "latency"), (), low, high + 1)
    phase_s = jax.random.uniform(stream(key, "phase"), ()) / config.rate_hz
    first = _noisy(stream(key, "first"), config, truth)
    line = jax.tree.map(lambda x: jnp.repeat(x[None], DELAY_LINE, 0), first)
    return CameraState(line, truth, latency, phase_s)


def step_camera(
    key: PRNGKeyArray, config: CameraConfig, camera: CameraState, truth: Frame
) -> CameraState:
    """Takes the newest frame up to now, if there is one and it is not lost.

    Exposures are at phase + k / rate. What was seen is interpolated between the control
    steps; of two frames in one control step, only the newer is read.

    Args:
        key: of this control step.
        config: settings.
        camera: the camera one control step before.
        truth: what there is to see now, with the time of now.
    """
    before, now_s = camera.truth, truth.t_s
    count = jnp.floor((now_s - camera.phase_s) * config.rate_hz)
    exposed_s = camera.phase_s + count / config.rate_hz
    share = (exposed_s - before.t_s) / (now_s - before.t_s)
    lost = jax.random.bernoulli(stream(key, "dropout"), config.dropout)
    taken = _noisy(key, config, _between(before, truth, share))
    fresh = (share > 0.0) & ~lost
    line = jax.tree.map(
        lambda kept, new: jnp.concatenate(
            [kept[1:], jnp.where(fresh, new, kept[-1])[None]]
        ),
        camera.line,
        taken,
    )
    return camera.replace(line=line, truth=truth)


def read_camera(camera: CameraState) -> Frame:
    """The sample that has arrived by now."""
    return jax.tree.map(lambda x: x[DELAY_LINE - 1 - camera.latency], camera.line)


def _between(before: Frame, after: Frame, share: Float[Array, ""]) -> Frame:
    """The scene at a share of the interval; headings turn the shorter way."""
    turn = after.heading_rad - before.heading_rad
    turn = jnp.arctan2(jnp.sin(turn), jnp.cos(turn))
    mixed = jax.tree.map(lambda a, b: a + share * (b - a), before, after)
    return mixed.replace(heading_rad=before.heading_rad + share * turn)


def _noisy(key: PRNGKeyArray, config: CameraConfig, seen: Frame) -> Frame:
    def normal(
        name: str, shape: tuple[int, ...], deviation: float
    ) -> Float[Array, "..."]:
        return deviation * jax.random.normal(stream(key, name), shape)

    position_m, heading_rad = config.position_noise_m, config.heading_noise_rad
    return seen.replace(
        object_pos_w=seen.object_pos_w + normal("object", (3,), position_m),
        root_pos_w=seen.root_pos_w + normal("root", (3,), position_m),
        heading_rad=seen.heading_rad + normal("heading", (), heading_rad),
    )
