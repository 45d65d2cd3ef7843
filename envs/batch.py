"""Many worlds at once, each restarted when its episode ends."""

from typing import Any, Protocol

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from envs.base import State


class Env(Protocol):
    """One world of a task."""

    @property
    def action_size(self) -> int:
        """Joints that the policy commands."""
        ...

    @property
    def observation_size(self) -> dict[str, int]:
        """Entries of each observation by name."""
        ...

    @property
    def dt(self) -> float:
        """Control interval [s]."""
        ...

    @property
    def episode_length(self) -> int:
        """Control steps of an episode that no failure ends."""
        ...

    def reset(self, key: Array) -> State:
        """Begins a new world."""
        ...

    def restart(self, state: State) -> State:
        """Begins the next episode of the same world."""
        ...

    def step(self, state: State, action: Array) -> State:
        """Advances one control step."""
        ...


class BatchEnv:
    """`num_envs` worlds of an environment, vmapped, with auto-reset.

    Where a step ends an episode, everything but reward, done, metrics, signals and info
    is that of the next episode's start.
    """

    def __init__(self, env: Env, num_envs: int, auto_reset: bool = True):
        self.env, self.num_envs, self.auto_reset = env, num_envs, auto_reset

    def __getattr__(self, name: str) -> Any:
        return getattr(self.env, name)

    @property
    def action_size(self) -> int:
        """Joints that the policy commands."""
        return self.env.action_size

    @property
    def observation_size(self) -> dict[str, int]:
        """Entries of each observation by name."""
        return self.env.observation_size

    @property
    def dt(self) -> float:
        """Control interval [s]."""
        return self.env.dt

    def reset(self, key: Array) -> State:
        """Begins `num_envs` worlds, world i from the i-th split of the key."""
        return jax.vmap(self.env.reset)(jax.random.split(key, self.num_envs))

    def step(self, state: State, action: Float[Array, "b a"]) -> State:
        """Advances every world by one control step."""
        state = self._forget_ended(state)
        after = jax.vmap(self.env.step)(state, action)
        if not self.auto_reset:
            return after
        # Episodes end rarely; most steps need no restart at all.
        return jax.lax.cond(jnp.any(after.done > 0), self._restart_done, _same, after)

    def _forget_ended(self, state: State) -> State:
        """Starts the sums of the running episode anew where the last one has ended."""
        if not self.auto_reset:
            return state
        names = ("episode_return", "episode_length")
        running = 1.0 - state.done
        sums = {name: state.info[name] * running for name in names}
        return state.replace(info=state.info | sums)

    def _restart_done(self, after: State) -> State:
        fresh = jax.vmap(self.env.restart)(after)

        def pick(new: Array, old: Array) -> Array:
            done = after.done.reshape((-1,) + (1,) * (new.ndim - 1)) > 0
            return jnp.where(done, new, old)

        parts = ("data", "obs", "memory")
        picked = {
            part: jax.tree.map(pick, getattr(fresh, part), getattr(after, part))
            for part in parts
        }
        return after.replace(**picked)


def _same(state: State) -> State:
    return state
