"""The learned policy out of a checkpoint: for evaluation, export and warm starts."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import flax.struct
import jax
import jax.numpy as jnp
import numpy as np
from jax.tree_util import Partial
from jaxtyping import Array, Float

from fingers_mjx.ppo.members import each, flat, parts, stacked
from fingers_mjx.ppo.state import TrainState
from fingers_mjx.runs import checkpoint
from fingers_mjx.runs.checkpoint import Saved
from fingers_mjx.runs.intact import newest_at

_POLICY = "train/params/policy/params/"
_NORMALIZER = "train/normalizer/"


class Network(Protocol):
    """Normalizer and dense layers, wherever they come from."""

    @property
    def mean(self) -> Float[np.ndarray | Array, " n"]:
        """Mean of each observation."""
        ...

    @property
    def std(self) -> Float[np.ndarray | Array, " n"]:
        """Standard deviation of each observation."""
        ...

    @property
    def layers(self) -> tuple[tuple[np.ndarray | Array, np.ndarray | Array], ...]:
        """Kernel [in, out] and bias [out] of each layer."""
        ...


@dataclass(frozen=True)
class Policy:
    """Deterministic actor: normalize, then dense layers with ELU between them.

    Attributes:
        mean: of each observation, as seen in training.
        std: its standard deviation, at least 1e-6.
        layers: (kernel [in, out], bias [out]) from input to action.
        noise_std: standard deviation of the exploration noise, per action.
        meta: what was noted in the checkpoint: "iteration", "env_steps", "config", …
    """

    mean: Float[np.ndarray, " n"]
    std: Float[np.ndarray, " n"]
    layers: tuple[tuple[np.ndarray, np.ndarray], ...]
    noise_std: Float[np.ndarray, " a"]
    meta: dict[str, Any]


def load_policy(path: Path) -> Policy:
    """Returns the policy of a run directory (its newest checkpoint) or checkpoint.

    Raises:
        InputError: if there is no intact checkpoint.
    """
    saved = read(path)
    arrays = saved.arrays
    hidden = sorted(k for k in arrays if k.startswith(f"{_POLICY}MLP_0/hidden_"))
    names = [k.removesuffix("/kernel") for k in hidden if k.endswith("/kernel")]
    layers = [_dense(arrays, name) for name in (*names, f"{_POLICY}Dense_0")]
    return Policy(
        mean=arrays[f"{_NORMALIZER}mean/state"],
        std=arrays[f"{_NORMALIZER}std/state"],
        layers=tuple(layers),
        noise_std=_noise(arrays),
        meta=dict(saved.meta),
    )


@flax.struct.dataclass
class _Weights:
    """A network as a pytree of arrays."""

    mean: Float[np.ndarray | Array, " n"]
    std: Float[np.ndarray | Array, " n"]
    layers: tuple[tuple[np.ndarray | Array, np.ndarray | Array], ...]


def acting(network: Network) -> Partial:
    """Returns the network as a function from observations to mean actions.

    What is compiled with it serves every network of the same sizes: its numbers are
    arguments and not constants.
    """
    return Partial(_act_on, _weights(network))


def acting_together(networks: Sequence[Network]) -> Partial:
    """Returns networks as one function, each of which acts in its part of the worlds.

    Args:
        networks: of the same sizes; the worlds of the first come first.

    Returns:
        As `acting`. On the CPU every network acts as alone, to the last bit.

    Source:
        Ours.
    """
    return Partial(_act_in_parts, stacked([_weights(one) for one in networks]))


def _weights(network: Network) -> _Weights:
    own = _Weights(network.mean, network.std, network.layers)
    return jax.tree.map(jnp.asarray, own)


def _act_on(weights: _Weights, obs: Mapping[str, Array]) -> Array:
    return act(weights, obs["state"])


def _act_in_parts(weights: _Weights, obs: Mapping[str, Array]) -> Array:
    own = parts(obs["state"], len(weights.mean))
    return flat(each(act)(weights, own))


def act(policy: Network, obs: Float[Array, "*b n"]) -> Float[Array, "*b a"]:
    """Returns the mean action, neither clipped nor squashed: the environment does that.

    a = W_k elu(… elu(W_0 (o - μ)/σ + b_0) …) + b_k, with o, μ, σ in the unit of each
    entry and a without one [1].

    Source:
        The actor of Brax's PPO, `make_networks` of `fingers_mjx.ppo.brax`.
    """
    hidden = (obs - policy.mean) / policy.std
    for kernel, bias in policy.layers[:-1]:
        hidden = jax.nn.elu(hidden @ kernel + bias)
    kernel, bias = policy.layers[-1]
    return hidden @ kernel + bias


def read(path: Path, say: Callable[[str], None] = print) -> Saved:
    """Returns the checkpoint at `path`, or the newest intact one of a run directory.

    Raises:
        InputError: if there is none.
    """
    return checkpoint.load(newest_at(path, say))


def warm_started(train: TrainState, saved: Saved) -> TrainState:
    """Returns the untrained `train` with networks and normalizer of a checkpoint.

    Raises:
        InputError: if the networks differ, naming the first array.
    """
    template = {"train": {"params": train.params, "normalizer": train.normalizer}}
    loaded = saved.part(template)["train"]
    return dataclasses.replace(train, **loaded)


def _dense(
    arrays: Mapping[str, np.ndarray], name: str
) -> tuple[np.ndarray, np.ndarray]:
    """Returns kernel and bias of the layer `name`."""
    return arrays[f"{name}/kernel"], arrays[f"{name}/bias"]


def _noise(arrays: Mapping[str, np.ndarray]) -> np.ndarray:
    """Returns the standard deviation of the noise, however it is parametrized."""
    log = arrays.get(f"{_POLICY}std_logparam/log_value")
    return arrays[f"{_POLICY}std_param/value"] if log is None else np.exp(log)
