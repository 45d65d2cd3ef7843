"""What a physics backend is: state in, state and sensors out, for one world."""

import functools
from typing import Protocol

import flax.struct
import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from jaxtyping import Array, Bool, Float, Int, Shaped

from envs.errors import InputError

ModelFields = dict[str, Array]
"""`MjModel` field name -> this world's value in the field's full shape.

Fields of `MjOption` are named `opt.<name>`, e.g. `opt.gravity`."""


def nominal_field(mj_model: mujoco.MjModel, name: str) -> Shaped[np.ndarray, "..."]:
    """The nominal value of a model field: x = model.name, in MuJoCo's units [m, kg, s].

    Args:
        mj_model: the model.
        name: a field, or `opt.<name>` for one of its options.

    Source:
        MuJoCo documentation, `mjModel`.
    """
    return functools.reduce(getattr, name.split("."), mj_model)


@flax.struct.dataclass
class PhysicsState:
    """All that is carried from one control step to the next, in float32.

    Attributes:
        qpos: positions; a free joint is position [m] and unit quaternion w x y z.
        qvel: velocities [m/s, rad/s].
        qacc_warmstart: last acceleration, from which the contact solver starts.
    """

    qpos: Float[Array, "*b nq"]
    qvel: Float[Array, "*b nv"]
    qacc_warmstart: Float[Array, "*b nv"]


@flax.struct.dataclass
class PhysicsOutput:
    """Result of one control step.

    Attributes:
        state: the state after the last substep.
        sensordata: sensors as `mj_step` leaves them, computed at the state before the
            last substep, under the controls of the last substep.
        overflow: bits of `mujoco_warp.OverflowType` for each contact or constraint
            buffer that was too small in any substep; 0 if none, and always 0 on the
            backends without fixed buffers (jax, cpu).
    """

    state: PhysicsState
    sensordata: Float[Array, "*b nsensordata"]
    overflow: Int[Array, "*b"]


class Physics(Protocol):
    """A backend: `n_substeps` calls of `mj_step` for one world, vmapped by the caller.

    The rules are the same on all backends. Row k of the controls acts in substep k.
    Model fields that are not given are those of `mj_model`; nothing is derived from
    the given ones, so whoever scales `body_mass` also gives `body_subtreemass`. A
    world that diverges (see `nan_if_diverged`) is NaN in state and sensors, is never
    reset silently, and leaves all other worlds as they are.
    """

    mj_model: mujoco.MjModel
    n_substeps: int

    def step(
        self,
        fields: ModelFields,
        state: PhysicsState,
        ctrl: Float[Array, "substeps nu"],
    ) -> PhysicsOutput:
        """One control step of one world: (s, u₁ … u_n; fields) ↦ (s', sensors).

        Args:
            fields: what differs from the nominal model.
            state: positions [m, rad] and velocities [m/s, rad/s] before.
            ctrl: controls of the substeps [rad].

        Source:
            MuJoCo documentation, Computation.
        """
        ...


def check_model(mj_model: mujoco.MjModel, n_substeps: int) -> None:
    """Checks that `PhysicsState` is the whole state of the model.

    Raises:
        InputError: the model has actuator activations, delays or plug-in state, which
            would be lost between control steps, or `n_substeps` is below one.
    """
    if n_substeps < 1:
        raise InputError("physics", "n_substeps", n_substeps, "at least 1")
    for size in ("na", "nhistory", "npluginstate"):
        if found := getattr(mj_model, size):
            raise InputError(
                "model",
                size,
                found,
                "0: actuators without activation, delays or plug-ins",
            )


def nan_if_diverged(output: PhysicsOutput) -> PhysicsOutput:
    """Makes a diverged world NaN throughout, by the bound that C MuJoCo uses.

    Diverged means that an entry of qpos, qvel or qacc_warmstart is not a number or
    exceeds `mjMAXVAL` = 1e10 in magnitude. `overflow` is kept.
    """

    def bad(x: Float[Array, " n"]) -> Bool[Array, ""]:
        return ~jnp.all(jnp.abs(x) <= mujoco.mjMAXVAL)

    state = output.state
    diverged = bad(state.qpos) | bad(state.qvel) | bad(state.qacc_warmstart)
    state, sensordata = jax.tree.map(
        lambda x: jnp.where(diverged, jnp.nan, x), (state, output.sensordata)
    )
    return PhysicsOutput(state, sensordata, output.overflow)
