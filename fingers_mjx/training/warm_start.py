"""Where a new run's networks come from: a run of the same task, or another's bundle."""

import dataclasses
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from envs.errors import InputError
from fingers_deploy import Bundle, load_bundle
from fingers_deploy.manifest import Interface, Term
from fingers_mjx.policy.actor import read, warm_started
from fingers_mjx.policy.interface import entry_factors, interface_of
from fingers_mjx.policy.place import is_bundle
from fingers_mjx.ppo.brax import PPONetworkParams
from fingers_mjx.ppo.state import TrainState

COUNT = 200_000
"""Observations that a bundle's normalizer counts as: new terms must soon count."""
KNOWN_COUNT = 100_000_000
"""The same if no term is new. The first observations of many worlds are those of an
episode's beginning; as many as these would change what the policy sees, and it falls.
"""
NEW_STD = 0.1
"""Standard deviation of inputs that the bundle did not have, until they are seen."""

_LAYERS = ("MLP_0", "Dense_0")
"""Parameters of the policy that are not its noise."""


def started_from(train: TrainState, env: Any, path: Path) -> TrainState:
    """Returns `train` with what `path` has learned in place of its own.

    A run or checkpoint gives actor, critic and normalizer. A bundle, which may be of
    another task, gives actor and normalizer: inputs go by the names of their terms, and
    those that the bundle did not have begin without influence. The action noise is that
    of the untrained `train`: at the end of a long training there is often too much of
    it for the clipped actions to distinguish one policy from another.

    Args:
        train: shapes of the networks (`train_template`), which remain where nothing
            was learned, or untrained networks.
        env: the batched environment (`envs.batch.BatchEnv`) that they are for.
        path: run directory, checkpoint or bundle.

    Raises:
        InputError: networks of other sizes.
        BundleError: a damaged bundle, or one for another hand.
    """
    if not is_bundle(path):
        found = warm_started(train, read(path))
        fresh, params = train.params.policy["params"], found.params.policy["params"]
        noise = {k: v for k, v in fresh.items() if k not in _LAYERS}
        policy = {**found.params.policy, "params": {**params, **noise}}
        return _with_policy(found, policy)
    bundle = load_bundle(path, env.hand.nominal.joint_names)
    theirs, ours = bundle.manifest.interface, interface_of(env)
    rows = _rows(theirs, ours)
    gain = theirs.action.scale_rad / ours.action.scale_rad
    layers = _layers(bundle, rows, gain)
    policy = _with_layers(train.params.policy, layers, bundle.source)
    mean, std = (_entries(x, rows, new) for x, new in _statistics(bundle, ours, gain))
    count = COUNT if (rows < 0).any() else KNOWN_COUNT
    normalizer = _with_statistics(train.normalizer, mean, std, count)
    return dataclasses.replace(_with_policy(train, policy), normalizer=normalizer)


def completed(learned: TrainState, fresh: TrainState) -> TrainState:
    """Returns `learned` with the leaves of `fresh` where it has shapes only."""
    return jax.tree.map(
        lambda ours, other: other if isinstance(ours, jax.ShapeDtypeStruct) else ours,
        learned,
        fresh,
    )


def _with_policy(train: TrainState, policy: Any) -> TrainState:
    value = train.params.value
    params = PPONetworkParams(policy=policy, value=value)  # pyright: ignore[reportCallIssue]
    return dataclasses.replace(train, params=params)


def _rows(theirs: Interface, ours: Interface) -> np.ndarray:
    """Returns where each of our observation's entries is in theirs, -1 if nowhere."""
    found = {term: at for term, at in _places(theirs)}
    parts = []
    for term, _ in _places(ours):
        size, at = term.size * term.history, found.get(term, -1)
        parts.append(np.arange(at, at + size) if at >= 0 else np.full(size, -1))
    return np.concatenate(parts)


def _places(interface: Interface) -> list[tuple[Term, int]]:
    terms = interface.observation.terms
    ends = np.cumsum([term.size * term.history for term in terms])
    return [
        (term, int(end) - term.size * term.history)
        for term, end in zip(terms, ends, strict=True)
    ]


def _layers(bundle: Bundle, rows: np.ndarray, gain: float) -> list[Any]:
    """Returns kernels and biases for our inputs and our size of action.

    Small outputs times the ratio of the scales move the targets as they did.
    """
    (kernel, bias), *inner, (last, last_bias) = bundle.network.layers
    kept = np.where((rows >= 0)[:, None], kernel[rows], 0.0)
    return [(kept, bias), *inner, (gain * last, gain * last_bias)]


def _statistics(bundle: Bundle, ours: Interface, gain: float) -> list[Any]:
    """Returns mean and deviation of their inputs, each with that of a new input."""
    network = bundle.network
    scale = entry_factors(bundle.manifest.interface, "previous_action", gain)
    return [(network.mean * scale, 0.0), (network.std * scale, NEW_STD)]


def _entries(
    values: Float[np.ndarray, " n"], rows: np.ndarray, new: float
) -> Float[np.ndarray, " m"]:
    return np.where(rows >= 0, values[rows], new)


def _with_layers(policy: Any, layers: list[Any], source: object) -> Any:
    """Returns the actor's parameters with other layers; its noise stays."""
    params = dict(policy["params"])
    hidden = dict(params["MLP_0"])
    names = sorted(hidden, key=lambda name: int(name.rsplit("_", 1)[1]))
    wanted = [*(hidden[name] for name in names), params["Dense_0"]]
    found = [np.shape(kernel) for kernel, _ in layers]
    shapes = [tuple(layer["kernel"].shape) for layer in wanted]
    if found != shapes:
        raise InputError(source, "layers", found, f"{shapes}, as this run has")
    new = [
        {"kernel": jnp.asarray(k, jnp.float32), "bias": jnp.asarray(b, jnp.float32)}
        for k, b in layers
    ]
    params["MLP_0"] = dict(zip(names, new[:-1], strict=True))
    params["Dense_0"] = new[-1]
    return {**policy, "params": params}


def _with_statistics(
    normalizer: Any, mean: np.ndarray, std: np.ndarray, count: int
) -> Any:
    """Returns the normalizer with known statistics of the actor's entries.

    The critic's observation begins with the actor's.
    """

    def filled(tree: Any, values: np.ndarray, rest: float) -> Any:
        return jax.tree.map(
            lambda x: jnp.full(x.shape, rest, x.dtype).at[: len(values)].set(values),
            tree,
        )

    number = type(normalizer.count)
    return normalizer.replace(
        mean=filled(normalizer.mean, mean, 0.0),
        std=filled(normalizer.std, std, 1.0),
        summed_variance=filled(normalizer.summed_variance, count * std**2, count),
        count=number(hi=0, lo=count),
    )
