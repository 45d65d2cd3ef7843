"""Tiny batched environments whose best policy and values are known by hand.

After the probes of Andy Jones and rejax: each can only be learned if one more part of
the learner works (value, discount, policy, both together, truncation, faults). Which
probe runs is data, not code, so that one compiled iteration serves them all.
"""

from dataclasses import dataclass

import jax
import jax.numpy as jnp

from envs.base import State

SITES = ("none", "obs", "privileged", "reward", "invalid")


@dataclass(frozen=True)
class Fault:
    """Writes `value` at `site` of one world, from step `at` on, before step `until`."""

    site: str = "none"
    value: float = 0.0
    world: int = 3
    at: int = 5
    until: int = 6


@dataclass(frozen=True)
class Probe:
    """Worlds that draw ±1 at the start of each episode.

    Attributes:
        num_envs: worlds.
        kind: index into `KINDS`.
        length: steps in an episode.
        truncates: the episode ends by the time limit instead of a failure.
        fault: what goes wrong.
    """

    num_envs: int
    kind: int = 0
    length: int = 1
    truncates: bool = False
    fault: Fault = Fault()
    action_size: int = 1
    dt: float = 0.02

    @property
    def observation_size(self):
        return {"state": 1, "privileged_state": 2}

    def reset(self, key):
        members = jnp.atleast_1d(key)
        share = self.num_envs // members.size
        keys = jax.vmap(lambda one: jax.random.split(one, share))(members).reshape(-1)
        fault = self.fault
        data = {
            "kind": jnp.int32(self.kind),
            "length": jnp.int32(self.length),
            "truncates": jnp.float32(self.truncates),
            "site": jnp.int32(SITES.index(fault.site)),
            "value": jnp.float32(fault.value),
            "first": jnp.int32(fault.at),
            "until": jnp.int32(fault.until),
        }
        worlds = jax.tree.map(lambda x: jnp.full(self.num_envs, x), data)
        worlds["hit"] = jnp.arange(self.num_envs) == fault.world
        worlds["clock"] = jnp.zeros(self.num_envs, jnp.int32)
        return jax.vmap(start)(keys, worlds)

    def step(self, state, action):
        return jax.vmap(step)(state, action)


REWARDS = (
    lambda draw, t, length, a: jnp.ones(()),
    lambda draw, t, length, a: draw,
    lambda draw, t, length, a: jnp.float32(t == length - 1),
    lambda draw, t, length, a: -((a - 0.7) ** 2),
    lambda draw, t, length, a: -((a - draw) ** 2),
)
KINDS = ("constant", "seen_value", "delayed", "target_action", "seen_action")


def observe(data, draw, t):
    table = [jnp.zeros(()), draw, jnp.float32(t), jnp.zeros(()), draw]
    seen = jnp.stack(table)[data["kind"]][None]
    return {"state": seen, "privileged_state": jnp.append(seen, 1.0)}


def start(key, data):
    key, key_draw = jax.random.split(key)
    draw = jax.random.rademacher(key_draw, (), jnp.float32)
    t, zero = jnp.zeros((), jnp.int32), jnp.zeros(())
    info = ("truncation", "invalid", "episode_return", "episode_length")
    return State(
        data=data,
        obs=observe(data, draw, t),
        reward=zero,
        done=zero,
        metrics={"reward/probe": zero},
        info=dict.fromkeys(info, zero),
        signals=None,
        memory={"key": key, "draw": draw, "t": t, "sum": zero},
    )


def step(state, action):
    data, draw, t = state.data, state.memory["draw"], state.memory["t"]
    outcomes = [rule(draw, t, data["length"], action[0]) for rule in REWARDS]
    reward = jnp.stack(outcomes)[data["kind"]]
    ended = t + 1 >= data["length"]
    total = state.memory["sum"] + reward
    info = {
        "truncation": ended * data["truncates"],
        "invalid": jnp.zeros(()),
        "episode_return": total,
        "episode_length": t + 1.0,
    }
    memory = state.memory | {"t": t + 1, "sum": total}
    on = {"obs": observe(data, draw, t + 1), "memory": memory}
    fresh = start(state.memory["key"], data)
    again = {"obs": fresh.obs, "memory": fresh.memory}
    after = jax.tree.map(lambda a, b: jnp.where(ended, a, b), again, on)
    return spoil(
        state.replace(
            data=data | {"clock": data["clock"] + 1},
            reward=reward,
            done=ended * 1.0,
            metrics={"reward/probe": reward},
            info=info,
            **after,
        ),
        data,
    )


def spoil(state, data):
    """Writes the fault of `data` into `state`, if this is the world and the time."""
    now = data["hit"] & (data["clock"] >= data["first"])
    now = now & (data["clock"] < data["until"])

    def at(site, x):
        here = now & (data["site"] == SITES.index(site))
        return jnp.where(here, data["value"], x)

    obs = {
        "state": at("obs", state.obs["state"]),
        "privileged_state": at("privileged", state.obs["privileged_state"]),
    }
    info = state.info | {"invalid": at("invalid", state.info["invalid"])}
    return state.replace(obs=obs, info=info, reward=at("reward", state.reward))


def probe(name, num_envs=64, **kwargs):
    """Returns the probe `name` of `KINDS`.

    constant: reward 1. seen_value: the reward is the observation. delayed: reward 1 in
    the last step. target_action: -(a - 0.7)². seen_action: -(a - observation)².
    """
    return Probe(num_envs, KINDS.index(name), **kwargs)
