"""Worlds of MuJoCo Playground that are looked at once in an iteration.

Brax reports ended episodes alone, the last hundred of them: here all worlds are.
"""

# pyright: reportMissingImports=false, reportAttributeAccessIssue=false
from collections.abc import Callable

import jax
import jax.numpy as jnp
from mujoco_playground import State, wrapper

from benchmarks.comparison.workers.ppo_settings import SETTINGS

EPISODE_STEPS = 1000
Look = Callable[[float, float], object]


def watching(look: Look) -> Callable:
    """Returns Playground's own wrapper with another around it.

    Args:
        look: is given the speed along the command [m/s], a mean of all worlds and
            steps of an iteration, and the falls by the number of worlds.
    """

    def wrap(env, **given) -> Watched:
        return Watched(wrapper.wrap_for_brax_training(env, **given), look)

    return wrap


class Watched(wrapper.Wrapper):
    """Worlds that begin with random ages, so that their episodes end at any time.

    Args:
        env: all worlds, as Playground wraps them.
        look: as of `watching`.
    """

    def __init__(self, env, look: Look):
        super().__init__(env)
        self._look = look

    def reset(self, rng: jax.Array) -> State:
        """Begins all worlds, each as if it had done some of its steps."""
        state = self.env.reset(rng)
        drawn = jax.vmap(lambda key: jax.random.uniform(jax.random.fold_in(key, 1)))
        ages = jnp.floor(drawn(rng) * EPISODE_STEPS).astype(state.info["steps"].dtype)
        tally = jnp.zeros((*ages.shape, 3))
        return state.replace(info=state.info | {"steps": ages, "tally": tally})

    def step(self, state: State, action: jax.Array) -> State:
        """Steps; counts steps, speed and falls, and shows their means."""
        after = self.env.step(state, action)
        fell = after.done * (1.0 - after.info["truncation"])
        seen = (jnp.ones_like(fell), after.metrics["speed_mps"], fell)
        tally = after.info["tally"] + jnp.stack(seen, axis=-1)
        full = tally[0, 0] >= SETTINGS["unroll"]
        jax.lax.cond(full, self._show, lambda means: None, tally.mean(axis=0))
        # Playground's wrapper begins physics anew, not what the task carries along.
        last = jnp.where(after.done[:, None] > 0, 0.0, after.info["last"])
        tally = jnp.where(full, 0.0, tally)
        return after.replace(info=after.info | {"last": last, "tally": tally})

    def _show(self, means: jax.Array) -> None:
        def on_host(means: jax.Array) -> None:
            steps, speed, falls = (float(x) for x in means)
            self._look(speed / steps, falls)

        jax.debug.callback(on_host, means)
