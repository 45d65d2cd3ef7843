"""Many worlds at once, each restarted when its episode ends."""

from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Key, PRNGKeyArray

from envs.base import State
from envs.env import HandEnv
from envs.streams import stream


class BatchEnv:
    """`num_envs` worlds of an environment, vmapped, with auto-reset.

    Where a step ends an episode, everything but reward, done, metrics, signals and info
    is that of the next episode's start. It is an `envs.base.VectorEnv`.

    With `spread_ends` the first episode of each world is cut short at a time of its
    own. Worlds that seldom fail stay in step without it: a learner sees the beginnings
    of all episodes, then nothing but their ends.
    """

    def __init__(
        self,
        env: HandEnv,
        num_envs: int,
        auto_reset: bool = True,
        spread_ends: bool = False,
    ):
        self.env, self.num_envs = env, num_envs
        self.auto_reset, self.spread_ends = auto_reset, spread_ends

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

    def reset(self, key: PRNGKeyArray | Key[Array, " members"]) -> State:
        """Begins `num_envs` worlds, world i from the i-th split of the key.

        Args:
            key: one, or several, each for an equal part of the worlds: that part is
                what a batch of its size alone would begin with.
        """
        keys = jnp.atleast_1d(key)
        share = self.num_envs // keys.size
        split = jax.vmap(lambda one: jax.random.split(one, share))(keys)
        return jax.vmap(self.env.reset)(split.reshape(self.num_envs))

    def step(self, state: State, action: Float[Array, "b a"]) -> State:
        """Advances every world by one control step, x_i ← f(x_i, a_i).

        Args:
            state: of all worlds.
            action: policy outputs [1].

        Returns:
            The states after it; with auto-reset, those of ended episodes begin anew.

        Source:
            Ours; the layout of the state is that of Brax and MuJoCo Playground.
        """
        state = self._forget_ended(state)
        after = jax.vmap(self.env.step)(state, action)
        if self.spread_ends:
            after = self._cut_short(after)
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

    def _cut_short(self, after: State) -> State:
        """Ends first episodes by their time limit, at a step that each world draws."""
        cut = jax.vmap(self._is_cut)(after) & (after.done == 0)
        truncation = jnp.where(cut, 1.0, after.info["truncation"])
        return after.replace(
            done=jnp.where(cut, 1.0, after.done),
            info=after.info | {"truncation": truncation},
        )

    def _is_cut(self, after: State) -> Bool[Array, ""]:
        world, steps = after.memory.world, after.memory.steps
        key = stream(world.key, "first_end")
        last = jax.random.randint(key, (), 1, self.env.episode_length + 1)
        return (world.episodes == 0) & (steps >= last)

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
