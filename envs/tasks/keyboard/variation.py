"""What differs from keyboard to keyboard, and how it lies before the hand."""

import flax.struct
import jax
import jax.numpy as jnp
import mujoco
from jaxtyping import Array, Float, PRNGKeyArray

from envs.config.settings.keyboard import KeyboardVariation as KeyboardVariation
from envs.physics.base import ModelFields
from envs.streams import stream
from envs.tasks.keyboard.model import (
    FORCE_N,
    KEY_NAMES,
    KEYBOARD,
    key_spring,
)


@flax.struct.dataclass
class KeyboardDraw:
    """One world's keyboard.

    Attributes:
        force_n: operating force of each key [N].
        actuation_m: actuation depth of each key [m].
        height_m: how much higher the keyboard is [m].
    """

    force_n: Float[Array, "*b keys"]
    actuation_m: Float[Array, "*b keys"]
    height_m: Float[Array, "*b"]


def draw_keyboard(key: PRNGKeyArray, config: KeyboardVariation) -> KeyboardDraw:
    """Draws the keyboard of a world.

    Args:
        key: the world's random key.
        config: ranges.
    """
    key, keys = stream(key, "keyboard"), (len(KEY_NAMES),)
    low, high = config.force_scale
    scale = jax.random.uniform(stream(key, "force"), keys, minval=low, maxval=high)
    low, high = config.actuation_m
    depth = jax.random.uniform(stream(key, "depth"), keys, minval=low, maxval=high)
    height = jax.random.uniform(stream(key, "height"), (), minval=-1.0)
    return KeyboardDraw(FORCE_N * scale, depth, config.height_m * height)


def keyboard_fields(
    model: mujoco.MjModel, fields: ModelFields, draw: KeyboardDraw
) -> ModelFields:
    """Adds what a world's keyboard differs in to the model fields of its hand."""
    board = model.body(KEYBOARD).id
    joints = jnp.array([model.joint(f"key_{name}").id for name in KEY_NAMES])
    adr = jnp.array([model.joint(f"key_{name}").qposadr[0] for name in KEY_NAMES])
    stiffness, free_m = key_spring(draw.force_n, draw.actuation_m)
    body_pos = fields.get("body_pos", jnp.asarray(model.body_pos))
    springs = {
        "jnt_stiffness": jnp.asarray(model.jnt_stiffness).at[joints].set(stiffness),
        "qpos_spring": jnp.asarray(model.qpos_spring).at[adr].set(free_m),
        "body_pos": body_pos.at[board, 2].add(draw.height_m),
    }
    return fields | springs


def misalignment(
    key: PRNGKeyArray, config: KeyboardVariation
) -> tuple[Float[Array, ""], Float[Array, "2"]]:
    """Pose error of the hand before the keyboard, uniform ψ ∈ [−b, b], s_i ∈ [−c, c].

    Args:
        key: of the episode.
        config: bounds b [°] and c [m].

    Returns:
        Turn ψ [rad], and shift s along x and y of the world [m].

    Source:
        Ours; the paper's operator aligns by trial presses.
    """
    bound_rad, bound_m = jnp.deg2rad(config.align_deg), config.align_m
    turn = jax.random.uniform(stream(key, "turn"), (), minval=-1.0)
    shift = jax.random.uniform(stream(key, "shift"), (2,), minval=-1.0)
    return bound_rad * turn, bound_m * shift
