"""The layers above bare physics: through JAX, the complete environment, PPO."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp

from benchmarks.speed.bare import Layer, bare_cpu, bare_warp
from envs.batch import BatchEnv

ACTION_STD = 0.3
MOVING = "bare, moving"
"""The layer of bare physics whose hands move; not for the backend jax."""
Build = Callable[[BatchEnv, int], Layer]
"""Makes a layer of so many control steps a call."""


def bare_physics(batch: BatchEnv, repeat: int, action_std: float = 0.0) -> Layer:
    """Native batch stepping; the backend jax has none other than `through_jax`."""
    backend = {"cpu": bare_cpu, "warp": bare_warp}.get(_backend(batch))
    if backend is None:
        return through_jax(batch, repeat)
    env: Any = batch.env
    return backend(env, batch.num_envs, action_std)


def bare_moving(batch: BatchEnv, repeat: int) -> Layer:
    """As `bare_physics`, under random actions as large as those of `environment`."""
    return bare_physics(batch, repeat, ACTION_STD)


def through_jax(batch: BatchEnv, repeat: int) -> Layer:
    """The physics backend as the environment calls it, with randomized models."""
    env: Any = batch.env
    worlds = jax.jit(batch.reset)(jax.random.key(0))
    ctrl = jnp.tile(jnp.array(env.stance.target_rad), (env.plant.n_substeps, 1))

    def one(world: Any, data: Any) -> Any:
        return env.physics.step(env.fields(world), data, ctrl).state

    @jax.jit
    def many(world: Any, data: Any) -> Any:
        step = jax.vmap(one)
        return jax.lax.fori_loop(0, repeat, lambda _, d: step(world, d), data)

    world = worlds.memory.world
    return Layer(lambda: jax.block_until_ready(many(world, worlds.data)), repeat)


def environment(batch: BatchEnv, repeat: int) -> Layer:
    """Complete environment steps with small random actions."""

    @jax.jit
    def many(state: Any, key: jax.Array) -> Any:
        def body(carry: Any, key: jax.Array) -> tuple[Any, None]:
            shape = (batch.num_envs, batch.action_size)
            return batch.step(carry, ACTION_STD * jax.random.normal(key, shape)), None

        return jax.lax.scan(body, state, jax.random.split(key, repeat))[0]

    state = jax.jit(batch.reset)(jax.random.key(0))
    return Layer(lambda: jax.block_until_ready(many(state, jax.random.key(1))), repeat)


def ppo(batch: BatchEnv, repeat: int) -> Layer:
    """Complete PPO iterations with the paper's networks, unroll and epochs."""
    del repeat
    from fingers_mjx.ppo.config import PpoConfig
    from fingers_mjx.ppo.iteration import compile_iterations, make_iteration
    from fingers_mjx.ppo.members import stacked
    from fingers_mjx.ppo.scalars import scalars_of
    from fingers_mjx.ppo.state import init_train_state, make_learner

    config = PpoConfig()
    learner = make_learner(batch, config)
    iterate = compile_iterations(make_iteration(batch, learner))
    scalars = stacked([scalars_of(config)])
    carry = [
        stacked([init_train_state(learner, batch, jax.random.key(0))]),
        jax.jit(batch.reset)(jax.random.key(1)),
        jax.random.key(2)[None],
    ]

    def call() -> None:
        *carry[:], _ = iterate(scalars, *carry)
        jax.block_until_ready(carry[0])

    return Layer(call, config.unroll_length)


def by_substep(layer: Build) -> Build:
    """The same layer with more calls from JAX into Warp."""

    def build(batch: BatchEnv, repeat: int) -> Layer:
        call_by_substep(batch)
        return layer(batch, repeat)

    return build


def call_by_substep(batch: BatchEnv) -> None:
    """Makes JAX call Warp once a physics step, not once a control step."""
    env: Any = batch.env
    env.physics.calls = "substep"


def _backend(batch: BatchEnv) -> str:
    """Returns the name of the backend of an environment."""
    env: Any = batch.env
    return getattr(env.physics, "impl", "cpu")


LAYERS: dict[str, Build] = {
    "bare physics": bare_physics,
    MOVING: bare_moving,
    "physics through JAX": through_jax,
    "environment": environment,
    "PPO": ppo,
}
BY_SUBSTEP: dict[str, Build] = {
    f"{name} by substep": by_substep(LAYERS[name])
    for name in ("physics through JAX", "environment", "PPO")
}
"""Layers only of the backend warp, and only where they are asked for."""
