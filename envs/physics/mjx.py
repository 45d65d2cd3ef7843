"""MuJoCo in JAX: MJX in pure JAX on any device, or MuJoCo Warp called from JAX."""

import copy
import hashlib
from typing import Any, Literal

import flax.struct
import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from jaxtyping import Array, Float

from envs.errors import InputError
from envs.physics import quiet_mjx
from envs.physics.base import (
    ModelFields,
    PhysicsOutput,
    PhysicsState,
    check_model,
    nan_if_diverged,
    nominal_field,
)
from envs.physics.quiet_mjx import mjx
from envs.physics.warp_call import make_control_step
from envs.physics.warp_kernels import compile_ahead
from envs.physics.warp_layout import Sizes


class MjxPhysics:
    """`envs.physics.Physics` on MJX.

    Args:
        mj_model: the nominal model.
        n_substeps: physics steps per control step.
        impl: "jax" or "warp".
        num_worlds: most worlds that are ever stepped together (Warp only: all worlds
            share one pool of contacts, whose size is fixed at compile time).
        contacts_per_world: mean number of contacts per world that the pool holds, and
            also of geom pairs that pass the broad phase (Warp only).
        constraints_per_world: most constraint rows of one world: limits, friction
            losses and contacts (Warp only).
        calls: what one call from JAX into Warp does, a whole control step or one
            physics step by `mjx.step`; the results are the same. The latter, with which
            benchmarks and tests compare, costs the host more (Warp only).

    Raises:
        InputError: the model uses what `impl` does not implement, or Warp is missing.
    """

    def __init__(
        self,
        mj_model: mujoco.MjModel,
        n_substeps: int,
        impl: Literal["jax", "warp"] = "jax",
        *,
        num_worlds: int = 1,
        contacts_per_world: int = 48,
        constraints_per_world: int = 128,
        calls: Literal["control_step", "substep"] = "control_step",
    ):
        check_model(mj_model, n_substeps)
        self.mj_model, self.n_substeps, self.impl = mj_model, n_substeps, impl
        self.calls = calls if impl == "warp" else "substep"
        room: Any = {}
        if impl == "warp":
            _check_warp()
            if jax.default_backend() == "gpu":
                compile_ahead()
            room = {
                "naconmax": num_worlds * contacts_per_world,
                "njmax": constraints_per_world,
            }
            self._whole = make_control_step(_sizes_of(mj_model, n_substeps, room))
        try:
            model = mjx.put_model(mj_model, impl=impl)
            data = mjx.make_data(mj_model, impl=impl, **room)
        except NotImplementedError as error:
            valid = f"a model of features in backend {impl}, or the backend cpu"
            raise InputError("model", "", error, valid) from error
        self._model = _without_prints(model) if impl == "warp" else model
        self._blind = _without_sensors(self._model)
        self._data = jax.tree.map(_uniform_or_array, data)

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

        Raises:
            InputError: `fields` names a field that cannot differ between worlds.

        Source:
            MuJoCo documentation, Computation and MuJoCo XLA.
        """
        if self.impl == "warp":
            _check_batchable(self.mj_model, fields)
        advance = self._by_substeps if self.calls == "substep" else self._whole
        output = advance(fields, state, ctrl)
        return nan_if_diverged(output.replace(overflow=self._lost(output.overflow)))

    def _by_substeps(
        self,
        fields: ModelFields,
        state: PhysicsState,
        ctrl: Float[Array, "substeps nu"],
    ) -> PhysicsOutput:
        """Returns what `mjx.step` makes of each substep."""
        blind, model = _with(self._blind, fields), _with(self._model, fields)

        # Warp replays a recorded CUDA graph when it finds its buffers at the addresses
        # it recorded. A scan keeps all substeps in the same buffers; unrolled, each
        # substep would need a graph of its own.
        def substep(data: Any, control: Float[Array, " nu"]) -> tuple[Any, None]:
            return _mj_step(blind, data.replace(ctrl=control)), None

        start = jax.tree.map(_array, self._data, is_leaf=_is_uniform).replace(
            qpos=state.qpos,
            qvel=state.qvel,
            qacc_warmstart=state.qacc_warmstart,
        )
        data, _ = jax.lax.scan(substep, start, ctrl[:-1], length=self.n_substeps - 1)
        data = _mj_step(model, data.replace(ctrl=ctrl[-1]))
        after = PhysicsState(data.qpos, data.qvel, data.qacc_warmstart)
        none = jnp.zeros((), jnp.int32)
        overflow = data._impl.overflow if self.impl == "warp" else none
        return PhysicsOutput(after, data.sensordata, overflow)

    def _lost(self, overflow: Array) -> Array:
        """Returns the buffer overflows of all substeps of a control step.

        Warp ORs its bits into the Data, which is fresh in each control step. It also
        reports there that a solver used up its iterations; that is no lost contact,
        and C MuJoCo and MJX say nothing about it either.
        """
        if self.impl != "warp":
            return overflow
        kinds = _overflow_type()
        return overflow & ~int(kinds.ITERATIONS | kinds.LS_ITERATIONS)


def _sizes_of(mj_model: mujoco.MjModel, n_substeps: int, room: dict[str, int]) -> Any:
    """Returns what `make_control_step` asks for, of the model as it is now."""
    model = copy.copy(mj_model)
    contents = np.empty(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, contents)
    digest = hashlib.sha256(contents.tobytes()).digest()

    def sizes_of(worlds: int, names: tuple[str, ...]) -> Sizes:
        fields = tuple((name, np.shape(nominal_field(model, name))) for name in names)
        return Sizes(digest, worlds, n_substeps, fields, mj_model=model, **room)

    return sizes_of


def _with(model: Any, fields: ModelFields) -> Any:
    """Returns the model with these fields; `opt.gravity` is one of its options."""
    plain = {name: value for name, value in fields.items() if "." not in name}
    options = {name: value for name, value in fields.items() if "." in name}
    return model.replace(**plain).tree_replace(options)


def _mj_step(model: Any, data: Any) -> Any:
    """Returns `mjx.step`, with a saturated actuator integrated as C and Warp do.

    The implicitfast integrator treats forces implicitly in velocity. A drive at its
    force limit does not depend on velocity, so C MuJoCo and Warp leave its damping out
    of the implicit matrix; MJX in JAX does not, and brakes joints whose drive is
    saturated as if by its whole velocity gain.
    """
    implicit = model.opt.integrator == mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    if model.impl.value != "jax" or not implicit:
        return mjx.step(model, data)
    data = mjx.forward(model, data)
    low, high = jnp.asarray(model.actuator_forcerange).T
    saturated = (data.actuator_force <= low) | (data.actuator_force >= high)
    follows = ~(saturated & jnp.asarray(model.actuator_forcelimited, bool))
    unsaturated = model.replace(
        actuator_gainprm=jnp.asarray(model.actuator_gainprm).at[:, 2].multiply(follows),
        actuator_biasprm=jnp.asarray(model.actuator_biasprm).at[:, 2].multiply(follows),
    )
    return mjx.implicit(unsaturated, data)


@flax.struct.dataclass
class _Uniform:
    """An array of one value; as a literal in the program it would be megabytes."""

    value: Any
    shape: tuple[int, ...] = flax.struct.field(pytree_node=False)


def _is_uniform(x: Any) -> bool:
    return isinstance(x, _Uniform)


def _uniform_or_array(x: Any) -> Any:
    """Returns the array, folded to one value if it has only one.

    Nearly all of a new Data is such: for 8192 worlds the contact pool is tens of
    megabytes of zeros, which would be compiled into the program.
    """
    array = np.asarray(x)
    if array.size > 1 and (array == array.flat[0]).all():
        return _Uniform(array.flat[0], array.shape)
    return x


def _array(x: Any) -> Any:
    return jnp.full(x.shape, x.value) if _is_uniform(x) else x


def _check_warp() -> None:
    if not quiet_mjx.WARP_INSTALLED:
        found = quiet_mjx.IMPORT_MESSAGES
        valid = "the extra cuda12 or cuda13 of fingers-mjx (make cuda12)"
        raise InputError("backend", "warp", found, valid)


def _overflow_type() -> Any:
    from mujoco.mjx.third_party.mujoco_warp import OverflowType

    return OverflowType


def _check_batchable(mj_model: mujoco.MjModel, fields: ModelFields) -> None:
    """Refuses fields that Warp reads once for all worlds, and those of integers.

    Under vmap it would take the worlds' axis of such a field for one of its own.
    """
    from mujoco.mjx.warp import types

    batchable = types._BATCH_DIM["Model"]
    for name in fields:
        known = batchable.get(name.replace(".", "__"), False)
        if not known or np.asarray(nominal_field(mj_model, name)).dtype.kind != "f":
            valid = "fields that MuJoCo Warp keeps per world, such as body_mass"
            raise InputError("physics fields", name, "a value per world", valid)


def _without_sensors(model: Any) -> Any:
    """Turns off the sensors: only those of the last substep are ever read."""
    off = model.opt.disableflags | mjx.DisableBit.SENSOR
    return model.tree_replace({"opt.disableflags": off})


def _without_prints(model: Any) -> Any:
    """Turns off Warp's printing of overflows; the environment counts and reports them.

    From within the GPU it would be up to a line for each world and physics step.
    """
    return model.tree_replace({"opt._impl.warn_overflow": 0})
