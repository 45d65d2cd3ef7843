"""A population in memory: environment, learners, the carried state, the compiled call.

A single run is a population of one member.
"""

from collections.abc import Mapping, Sequence
from dataclasses import MISSING, dataclass, fields, is_dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int, PRNGKeyArray

from envs.base import State, VectorEnv
from envs.config.typed import to_dict
from envs.scoring import scheduled_weights, with_weights
from fingers_mjx.ppo.config import bound_fields
from fingers_mjx.ppo.iteration import Iteration, make_iteration, repeat_iterations
from fingers_mjx.ppo.members import (
    each,
    flat,
    member_of,
    parts,
    split_each,
    stacked,
)
from fingers_mjx.ppo.rollout import FAULTS
from fingers_mjx.ppo.scalars import (
    PpoScalars,
    StartScalars,
    scalars_of,
    start_scalars_of,
    starting,
)
from fingers_mjx.ppo.state import (
    Carry,
    TrainState,
    init_train_state,
    make_learner,
    strong,
)
from fingers_mjx.ppo.totals import Totals
from fingers_mjx.ppo.update import watched_names
from fingers_mjx.runs.setup import Setup

HEALTH = (
    "worst_streak",
    "skipped",
    "first_term",
    "first_iteration",
    "fault",
    "fault_world",
    "fault_iteration",
)
"""Fields of `Health` that each call reports to the host."""


@dataclass(frozen=True)
class Report:
    """What a call leaves on the device for the host to fetch when it wants to.

    Attributes:
        sums: sum and weight of each metric of each member.
        health: the fields `HEALTH` of each member.
    """

    sums: Float[Array, "s k 2"]
    health: Int[Array, "s h"]

    def fetch_sums(self) -> Float[np.ndarray, "s k 2"]:
        """Waits for the call and returns (Σ w x, Σ w) [its unit, 1] of each metric.

        Source:
            Ours, see `fingers_mjx.ppo.totals.total`.
        """
        return np.asarray(self.sums)

    def fetch_health(self) -> list[dict[str, int]]:
        """Waits for the call and returns the health of each member."""
        rows = np.asarray(self.health).tolist()
        return [dict(zip(HEALTH, row, strict=True)) for row in rows]


class Session:
    """Compiled training of one environment by one or more learners.

    Args:
        env: worlds of all members, in equal parts.
        setups: of the members; they differ in seed and `VARYING` settings alone
            (`fingers_mjx.training.population`).

    Attributes:
        members: how many there are.
        names: of the metrics, in the order of `Report.sums`.
        terms: names that `Health.first_term` points into.
        template: shapes and types of the state of one member.
    """

    def __init__(self, env: VectorEnv, setups: Sequence[Setup]):
        self.env, self.setups, self.members = env, tuple(setups), len(setups)
        config = setups[0].train
        self.learner = make_learner(env, config.ppo)
        self._scalars = stacked([scalars_of(setup.train.ppo) for setup in setups])
        iteration = repeat_iterations(
            make_iteration(env, self.learner), config.iterations_per_call
        )
        whole = jax.eval_shape(self._start)
        shapes = jax.eval_shape(iteration, self._scalars, *_parts(whole))
        self.names = sorted(shapes[3])
        self.terms = watched_names(whole.train.params)
        self.template = jax.eval_shape(self._part, whole)[0]
        self._call = jax.jit(_reporting(iteration), donate_argnums=(1, 2, 3))
        self._split, self._join = jax.jit(self._part), jax.jit(_joined)

    def start(self) -> Carry:
        """Returns the carried state of an untrained population."""
        return strong(jax.jit(self._start)())

    def advance(self, carry: Carry) -> tuple[Carry, Report]:
        """Starts the next call and returns without waiting; `carry` is used up."""
        *after, sums, health = self._call(self._scalars, *_parts(carry))
        return Carry(*after), Report(sums, health)

    def split(self, carry: Carry) -> list[Carry]:
        """Returns the state of each member, as a run of its own would carry it."""
        return self._split(carry)

    def join(self, carries: Sequence[Carry]) -> Carry:
        """Returns the state of the population of the members' states."""
        return self._join(list(carries))

    def fault(self, health: Mapping[str, int]) -> str:
        """Returns one sentence on the latest step that was set aside."""
        what = FAULTS[health["fault"]]
        return (
            f"iteration {health['fault_iteration']}: {what} of world "
            f"{health['fault_world']} is not finite; the step was set aside"
        )

    def _start(self) -> Carry:
        """Returns fresh networks, worlds and key of each member, all from its seed."""
        seeds = jnp.stack([jax.random.key(setup.train.seed) for setup in self.setups])
        keys, world_keys, network_keys = split_each(seeds, 3)
        own = stacked([start_scalars_of(setup.train.ppo) for setup in self.setups])
        train = each(self._untrained)(own, network_keys)
        worlds = self._with_own_weights(self.env.reset(world_keys))
        return Carry(train, worlds, keys)

    def _untrained(self, own: StartScalars, key: PRNGKeyArray) -> TrainState:
        """Returns what a member starts from."""
        config = starting(self.learner.config, own)
        return init_train_state(make_learner(self.env, config), self.env, key)

    def _with_own_weights(self, worlds: State) -> State:
        """Gives the worlds of each member the reward weights and the pace it is set."""
        if self.members == 1:
            return worlds
        env: Any = self.env
        weights = [
            scheduled_weights(
                env.table, e.weights, e.curriculum_scale, e.schedule_scale
            )
            for e in (setup.env for setup in self.setups)
        ]
        worlds_each = self.env.num_envs // self.members
        repeated = jax.tree.map(
            lambda x: jnp.repeat(x, worlds_each, axis=0), stacked(weights)
        )
        return with_weights(worlds, repeated)

    def _part(self, carry: Carry) -> list[Carry]:
        """Returns the state of each member; see `split`."""
        stack = Carry(carry.train, parts(carry.worlds, self.members), carry.key)
        return [member_of(stack, index) for index in range(self.members)]


def bound(env: VectorEnv, setup: Setup, identity: Mapping[str, Any]) -> dict[str, Any]:
    """Returns what a resumed run must share with the saved one.

    JAX counts up to its minor version: later ones draw other random numbers and
    compile other programs.
    """
    return {
        "train": bound_fields(setup.train),
        "env": to_dict(setup.env),
        "observation_size": dict(env.observation_size),
        "action_size": env.action_size,
        "identity": dict(identity),
        "jax": ".".join(jax.__version__.split(".")[:2]),
        "platform": jax.default_backend(),
    }


def unset(setup: Setup) -> dict[str, Any]:
    """Returns the settings of `bound` as they are where nobody sets them."""
    parts = {"train": setup.train, "env": setup.env}
    return {name: _defaults(x) for name, x in parts.items() if is_dataclass(x)}


def _defaults(config: Any) -> dict[str, Any]:
    made = {f.name: f.default_factory for f in fields(config)}
    given = {f.name: f.default for f in fields(config) if f.default is not MISSING}
    called = {k: make() for k, make in made.items() if make is not MISSING}
    return to_dict(given | called)


def _joined(carries: list[Carry]) -> Carry:
    """Returns the state of the population; see `Session.join`."""
    stack = stacked(carries)
    return Carry(stack.train, flat(stack.worlds), stack.key)


def _parts(carry: Carry) -> tuple[TrainState, State, PRNGKeyArray]:
    """Returns the three arguments of an iteration that a call uses up."""
    return carry.train, carry.worlds, carry.key


def _reporting(iteration: Iteration) -> Iteration:
    """Returns `iteration` with its metrics and health packed into two arrays."""

    def call(
        scalars: PpoScalars, train: TrainState, worlds: State, keys: PRNGKeyArray
    ) -> Any:
        train, worlds, keys, totals = iteration(scalars, train, worlds, keys)
        health = jnp.stack([getattr(train.health, name) for name in HEALTH], axis=-1)
        return train, worlds, keys, _pack(totals), health

    return call


def _pack(totals: Totals) -> Float[Array, "s k 2"]:
    """Returns the totals as one array, in the order of their names."""
    return jnp.stack([totals[name] for name in sorted(totals)], axis=1)
