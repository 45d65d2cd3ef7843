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
from fingers_mjx.ppo.members import each, flat, parts, split_each
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
    keys: PRNGKeyArray,
) -> tuple[State, Rollout, Totals]:
    """Returns the worlds after `unroll_length` steps, their experience and metrics.

    a_t ~ π_m(· | o_t), s_{t+1} = step(s_t, a_t) in every world of every member m.

    A step is not valid if the environment reports it (`info["invalid"]`), or if its
    reward, or the observation before or after it, is not finite. It is then truncated
    with reward zero, which takes it out of loss and normalizer; the other worlds are
    not touched.

    Args:
        env: worlds of all members, in equal parts.
        learner: networks and settings that all share.
        train: of all members, which come first in each leaf.
        state: of all worlds.
        keys: one random key per member.
    """
    members = keys.shape[0]

    def act(
        train: TrainState, obs: dict[str, Array], key: PRNGKeyArray
    ) -> dict[str, Any]:
        apply = learner.networks.policy_network.apply
        logits = apply(train.normalizer, train.params.policy, obs)
        action, log_prob = sample_action(learner.networks, logits, key)
        return {"action": action, "log_prob": log_prob, "logits": logits}

    def step(state: State, keys: PRNGKeyArray) -> tuple[State, dict[str, Any]]:
        obs, obs_ok = screen(state.obs)
        drawn = flat(each(act)(train, parts(obs, members), keys))
        state = fixed_types(env.step(state, drawn["action"]))
        seen = {"obs": obs, "obs_ok": obs_ok, **drawn}
        return state, {**seen, **_outcome(state, members)}

    times = split_each(keys, learner.config.unroll_length)
    state, steps = jax.lax.scan(step, state, times)
    last_obs, last_ok = screen(state.obs)
    ok = jnp.concatenate([steps.pop("obs_ok"), last_ok[None]])
    sums, overflow = steps.pop("totals"), steps.pop("overflow")
    rollout = _seal(steps, ok[:-1] & ok[1:], last_obs["privileged_state"])
    rollout = _of_members(rollout, members)
    totals = each(_totals)(_members_first(sums), _worlds_of(overflow, members), rollout)
    return state, rollout, totals


def _members_first(steps: Any) -> Any:
    """Returns leaves [time, S, …] as [S, time, …]."""
    return jax.tree.map(lambda x: jnp.moveaxis(x, 1, 0), steps)


def _worlds_of(steps: Any, members: int) -> Any:
    """Returns leaves [time, S·W, …] as [S, time, W, …]."""
    split = jax.tree.map(lambda x: x.reshape(len(x), members, -1, *x.shape[2:]), steps)
    return _members_first(split)


def _of_members(rollout: Rollout, members: int) -> Rollout:
    """Returns the experience of a flat batch with the members first."""
    steps = {k: v for k, v in vars(rollout).items() if k != "last_obs"}
    return Rollout(
        last_obs=parts(rollout.last_obs, members), **_worlds_of(steps, members)
    )


def _totals(
    sums: Totals, overflow: dict[str, Bool[Array, "t b"]], rollout: Rollout
) -> Totals:
    """Returns the metrics of one member: of its steps and of its whole rollout."""
    totals = {name: jnp.sum(x, axis=0) for name, x in sums.items()}
    for name, hit in overflow.items():
        totals[f"{name}_worlds"] = count(jnp.any(hit, axis=0))
    return totals | rollout_totals(rollout)


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


def _outcome(state: State, members: int) -> dict[str, Any]:
    """Returns what one step gave: reward, endings, faults and metrics."""
    reported, finite = state.info["invalid"] != 0, jnp.isfinite(state.reward)
    seen = (state.metrics, state.info, state.done, ~reported & finite)
    return {
        "reward": state.reward,
        "done": state.done,
        "truncation": state.info["truncation"],
        "fault": jnp.where(reported, 1, jnp.where(finite, 0, 2)),
        "totals": each(_step_totals)(*parts(seen, members)),
        "overflow": {k: state.metrics[k] > 0 for k in ROOM if k in state.metrics},
    }


def _step_totals(
    metrics: Mapping[str, Float[Array, " b"]],
    info: Mapping[str, Float[Array, " b"]],
    done: Float[Array, " b"],
    healthy: Bool[Array, " b"],
) -> Totals:
    """Returns return and length of the episodes that ended, and the mean metrics."""
    ended = (done > 0) & healthy
    totals = {name: total(x, healthy) for name, x in metrics.items()}
    totals["episode/return"] = total(info["episode_return"], ended)
    totals["episode/length"] = total(info["episode_length"], ended)
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
