"""One call from JAX into MuJoCo Warp for all physics steps of a control step.

`mjx.step` passes Warp's whole model and Data, some 500 buffers, in each physics step,
which costs the host more time than a GPU needs for the step. Here Warp keeps both to
itself, and two buffers pass: what goes in and what comes out, each one after the other.
"""

import functools
import inspect
import math
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from envs.physics.base import ModelFields, PhysicsOutput, PhysicsState
from envs.physics.warp_layout import Sizes
from envs.physics.warp_worlds import worlds_of

Inputs = tuple[ModelFields, PhysicsState, Float[Array, "w substeps nu"]]
Outputs = tuple[PhysicsState, Float[Array, "w nsensordata"], Int[Array, " w"]]


def make_control_step(
    sizes_of: Callable[[int, tuple[str, ...]], Sizes],
) -> Callable[[ModelFields, PhysicsState, Any], PhysicsOutput]:
    """Returns a control step of one world, (s, u₁ … u_n; fields) ↦ (s', sensors).

    Under any number of vmaps all worlds are one call. The overflow bits are as Warp
    left them, and a diverged world is as it is.

    Args:
        sizes_of: what Warp has to hold for so many worlds and these model fields.

    Source:
        MuJoCo documentation, Computation and MuJoCo Warp.
    """

    @jax.custom_batching.custom_vmap
    def worlds(*inputs: Any) -> Outputs:
        return _call(sizes_of, *inputs)

    @worlds.def_vmap
    def more_worlds(axis_size: int, batched: Any, *inputs: Any) -> tuple[Any, Any]:
        merge = functools.partial(_merge, axis_size)
        outputs = worlds(*jax.tree.map(merge, inputs, tuple(batched)))
        split = jax.tree.map(lambda x: _split(axis_size, x), outputs)
        return split, jax.tree.map(lambda _: True, split)

    def one(
        fields: ModelFields, state: PhysicsState, ctrl: Float[Array, "substeps nu"]
    ) -> PhysicsOutput:
        inputs = jax.tree.map(lambda x: jnp.asarray(x)[None], (fields, state, ctrl))
        return PhysicsOutput(*jax.tree.map(lambda x: x[0], worlds(*inputs)))

    return one


def _merge(axis_size: int, x: Array, batched: bool) -> Array:
    """Returns `x` with the axis of a vmap and the worlds' axis as one."""
    if not batched:
        x = jnp.broadcast_to(x, (axis_size, *x.shape))
    return x.reshape(axis_size * x.shape[1], *x.shape[2:])


def _split(axis_size: int, x: Array) -> Array:
    return x.reshape(axis_size, x.shape[0] // axis_size, *x.shape[1:])


def _call(sizes_of: Any, fields: Any, state: Any, ctrl: Any) -> Outputs:
    """Steps worlds that are stacked along the first axis."""
    sizes = sizes_of(len(ctrl), tuple(sorted(fields)))
    given = {"ctrl": ctrl.swapaxes(0, 1), **fields, **vars(state)}
    parts = [_padded(given[name], part.room) for name, part in sizes.given.items()]
    result, overflow = _entry(sizes)(jnp.concatenate(parts))
    found = {}
    for name, part in sizes.result.items():
        start = part.start - sizes.result_start
        found[name] = result[start : start + math.prod(part.shape)].reshape(part.shape)
    sensordata = found.pop("sensordata")
    return PhysicsState(**found), sensordata, overflow


def _padded(x: Array, room: int) -> Array:
    return jnp.pad(x.ravel(), (0, room - x.size))


@functools.cache
def _entry(sizes: Sizes) -> Any:
    """Returns the function of JAX's arrays that Warp registers with XLA."""
    import warp as wp  # pyright: ignore[reportMissingImports]
    from mujoco.mjx.third_party import mujoco_warp as mjw

    def control_step(given: Any, result: Any, overflow: Any) -> None:
        worlds_of(sizes, wp.get_device().alias).advance(given, result, overflow)

    # Warp loads a callable's module before the call; ours has no kernels to compile.
    control_step.__module__ = mjw.step.__module__

    floats, integers = wp.array(dtype=float), wp.array(dtype=int)
    types = {"given": floats, "result": floats, "overflow": integers}
    control_step.__annotations__ = types
    # Warp does not see through the wrapper that checks shapes in the tests.
    control_step.__dict__["__signature__"] = inspect.signature(control_step)
    length = sizes.length - sizes.result_start
    return wp.jax_callable(
        control_step,
        num_outputs=2,
        # Buffers of XLA move from call to call. The graphs are recorded over there, on
        # Warp's own memory, once.
        graph_mode=wp.JaxCallableGraphMode.NONE,
        vmap_method=None,
        output_dims={"result": length, "overflow": sizes.worlds},
    )
