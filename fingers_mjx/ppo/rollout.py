"""Experience: unroll the policy in the batched environment, set faulty steps aside."""

from collections.abc import Mapping
from typing import Any

import flax.struct
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int, PRNGKeyArray

from envs.base import State, VectorEnv
from envs.physics.room import ROOM
from fingers_mjx.ppo.brax import sample_action
from fingers_mjx.ppo.state import Learner, TrainState, fixed_types
from fingers_mjx.ppo.totals import Totals, count, total

FAULTS = ("nothing", "state", "reward", "observation")
"""What can be non-finite in a step; "state" is what the environment itself reports."""


@flax.struct.dataclass
class Rollout:
    """Experience of one iteration, time first.

    Attributes:
        obs: observations that the policy saw; rows that were not finite are zero.
        last_obs: critic's observation after the last step.
        action: unclipped policy output.
        log_prob: log-probability of `action` when it was drawn.
        logits: mean and standard deviation of the policy when it acted.
        reward: reward of the step; zero where the step is not valid.
        done: 1 if the episode ended in the step.
        truncation: 1 if it ended without a failure, or the step is not valid.
        fault: index into `FAULTS` of what was wrong with the step; 0 if nothing.
    """

    obs: dict[str, Float[Array, "t b _"]]
    last_obs: Float[Array, "b m"]
    action: Float[Array, "t b a"]
    log_prob: Float[Array, "t b"]
    logits: tuple[Float[Array, "t b a"], Float[Array, "t b a"]]
    reward: Float[Array, "t b"]
    done: Float[Array, "t b"]
    truncation: Float[Array, "t b"]
    fault: Int[Array, "t b"]

    @property
    def valid(self) -> Bool[Array, "t b"]:
        """Whether each step may be learned from."""
        return self.fault == 0


def unroll(
    env: VectorEnv,
    learner: Learner,
    train: TrainState,
    state: State,
    key: PRNGKeyArray,
) -> tuple[State, Rollout, Totals]:
    """Returns the worlds after `unroll_length` steps, their experience and metrics.

    a_t ~ π(· | o_t), s_{t+1} = step(s_t, a_t) in every world.

    A step is not valid if the environment reports it (`info["invalid"]`), or if its
    reward, or the observation before or after it, is not finite. It is then truncated
    with reward zero, which takes it out of loss and normalizer; the other worlds are
    not touched.
    """
    networks = learner.networks

    def act(state: State, key: PRNGKeyArray) -> tuple[State, dict[str, Any]]:
        obs, obs_ok = screen(state.obs)
        logits = networks.policy_network.apply(
            train.normalizer, train.params.policy, obs
        )
        action, log_prob = sample_action(networks, logits, key)
        state = fixed_types(env.step(state, action))
        drawn = {"obs": obs, "action": action, "log_prob": log_prob, "logits": logits}
        return state, {**drawn, "obs_ok": obs_ok, **_outcome(state)}

    keys = jax.random.split(key, learner.config.unroll_length)
    state, steps = jax.lax.scan(act, state, keys)
    last_obs, last_ok = screen(state.obs)
    ok = jnp.concatenate([steps.pop("obs_ok"), last_ok[None]])
    totals = jax.tree.map(lambda x: jnp.sum(x, axis=0), steps.pop("totals"))
    for name, hit in steps.pop("overflow").items():
        totals[f"{name}_worlds"] = count(jnp.any(hit, axis=0))
    rollout = _seal(steps, ok[:-1] & ok[1:], last_obs["privileged_state"])
    return state, rollout, totals | rollout_totals(rollout)


def screen(
    obs: Mapping[str, Float[Array, "b _"]],
) -> tuple[dict[str, Float[Array, "b _"]], Bool[Array, " b"]]:
    """Returns `obs`, zero in worlds with a non-finite value, and which are finite.

    okᵢ = ∧ isfinite(oᵢ) over all entries of all observations of world i; oᵢ ← 0 [unit
    of the entry] where not okᵢ [1].

    Source:
        Ours: zero times the weight 0 is 0; NaN times 0 would still be NaN.
    """
    rows = [jnp.all(jnp.isfinite(x), axis=-1) for x in obs.values()]
    ok = jnp.all(jnp.stack(rows), axis=0)
    return {k: jnp.where(ok[:, None], x, 0.0) for k, x in obs.items()}, ok


def _outcome(state: State) -> dict[str, Any]:
    """Returns what one step gave: reward, endings, faults and metrics."""
    reported, finite = state.info["invalid"] != 0, jnp.isfinite(state.reward)
    return {
        "reward": state.reward,
        "done": state.done,
        "truncation": state.info["truncation"],
        "fault": jnp.where(reported, 1, jnp.where(finite, 0, 2)),
        "totals": _step_totals(state, ~reported & finite),
        "overflow": {k: state.metrics[k] > 0 for k in ROOM if k in state.metrics},
    }


def _step_totals(state: State, healthy: Bool[Array, " b"]) -> Totals:
    """Returns return and length of the episodes that ended, and the mean metrics."""
    ended = (state.done > 0) & healthy
    totals = {name: total(x, healthy) for name, x in state.metrics.items()}
    totals["episode/return"] = total(state.info["episode_return"], ended)
    totals["episode/length"] = total(state.info["episode_length"], ended)
    return totals


def _seal(
    steps: dict[str, Any], obs_ok: Bool[Array, "t b"], last_obs: Float[Array, "b m"]
) -> Rollout:
    """Returns the experience with its faulty steps truncated and without reward."""
    seen = jnp.where(obs_ok, 0, FAULTS.index("observation"))
    steps["fault"] = jnp.where(steps["fault"] == 0, seen, steps["fault"])
    valid = steps["fault"] == 0
    steps["reward"] = jnp.where(valid, steps["reward"], 0.0)
    steps["truncation"] = jnp.where(valid, steps["truncation"], 1.0)
    steps["done"] = jnp.where(valid, steps["done"], 1.0)
    return Rollout(last_obs=last_obs, **steps)


def rollout_totals(rollout: Rollout) -> Totals:
    """Returns metrics of the whole rollout: invalid steps, endings, noise, entropy.

    The entropy of a normal with independent entries is Σ_j (ln σ_j + ½ ln 2πe) [nat].
    """
    std = rollout.logits[1]
    entropy = jnp.sum(jnp.log(std) + 0.5 * jnp.log(2 * jnp.pi * jnp.e), axis=-1)
    ended = rollout.valid & (rollout.done > 0)
    failed = ended & (rollout.truncation == 0)
    return {
        "invalid": count(~rollout.valid),
        "episode/ended": count(ended),
        "episode/failed": count(failed),
        "policy/std": total(std),
        "policy/entropy": total(entropy),
    }
