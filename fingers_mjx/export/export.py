"""Export: a trained actor becomes a policy bundle, or an error."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jax
import numpy as np
from jaxtyping import Float

from fingers_deploy import BundleError
from fingers_deploy.bundle import PARITY_TOLERANCE
from fingers_deploy.manifest import Interface, Provenance
from fingers_deploy.policy import OnnxPolicy
from fingers_mjx.export.bundle import encode_bundle, write_bundle
from fingers_mjx.export.onnx_graph import PolicyWeights

Apply = Callable[[Float[np.ndarray, "B N"]], Any]

OBSERVATIONS = 4096
PARITY_ROWS = 8


class ExportError(ValueError):
    """The exported graph is not the trained network (status 2)."""

    exit_code = 2


@dataclass(frozen=True)
class ExportReport:
    """Largest absolute difference of any action from JAX, random observations.

    Attributes:
        onnxruntime: of ONNX Runtime.
        numpy: of the NumPy policy.
        observations: number of observations compared, the extreme ones included.
    """

    onnxruntime: float
    numpy: float
    observations: int


def export_policy(
    out_dir: str | Path,
    weights: PolicyWeights,
    apply: Apply,
    task: str,
    interface: Interface,
    provenance: Provenance,
) -> ExportReport:
    """Writes the bundle of a trained actor after comparing it with JAX.

    JAX (on the CPU, in full float32, row by row), ONNX Runtime and the NumPy policy
    see the same 4,096 random observations around the normalizer's mean and 12 extreme
    ones. The measure is max |Δa| over the clipped actions of an observation, at most
    1e-5·max(1, max |a|) with a before the clip: rounding in float32 grows with the
    numbers inside, which in a long training reach a hundred times the clip.

    Args:
        out_dir: directory of the bundle; written only if everything agrees.
        weights: the network, e.g. from `brax_weights`.
        apply: the trained network, traceable by JAX: observations [B, N] to mean
            actions [B, A] before the clip. Arrays that it closes over are best on the
            host (`jax.device_get`), as `brax_apply` has them.
        task: name of the task.
        interface: what the policy reads and what its output means.
        provenance: how it was made.

    Raises:
        ExportError: a difference above the tolerance, or weights or fields that are
            not finite or do not fit each other.
        OSError: the disk is full or not writable.
    """
    obs = sample_observations(weights)
    mean_action = _evaluate(apply, obs)
    action = np.clip(mean_action, -weights.action_clip, weights.action_clip)
    known = obs[:PARITY_ROWS], action[:PARITY_ROWS]
    try:
        bundle = encode_bundle(weights, task, interface, provenance, known)
    except BundleError as error:
        raise ExportError(str(error)) from error
    runtimes = {"onnxruntime": OnnxPolicy(bundle.model), "numpy": bundle.network}
    allowed = _allowed(mean_action)
    differences = {
        name: _compare(name, np.stack(list(map(policy, obs))), action, allowed)
        for name, policy in runtimes.items()
    }
    write_bundle(out_dir, bundle)
    return ExportReport(observations=len(obs), **differences)


def sample_observations(
    weights: PolicyWeights, seed: int = 0
) -> Float[np.ndarray, "B N"]:
    """Observations o = μ + σ n, 4,096 random and 12 extreme [unit of each entry, 1].

    Random: n standard normal. Extreme: zeros, the mean, and corners n = ±r with random
    signs for r = 3 … 100.

    Source:
        Ours.
    """
    rng = np.random.default_rng(seed)
    size = len(weights.mean)
    corners = rng.choice([-1.0, 1.0], (10, size)) * np.geomspace(3, 100, 10)[:, None]
    units = np.concatenate(
        [rng.standard_normal((OBSERVATIONS, size)), np.zeros((1, size)), corners]
    )
    obs = weights.mean + weights.std * units
    return np.concatenate([obs, np.zeros((1, size))]).astype(np.float32)


def brax_weights(
    policy_params: Mapping[str, Any],
    normalizer: Any,
    action_clip: float,
    obs_key: str = "state",
) -> PolicyWeights:
    """Takes the actor out of Brax's PPO parameters.

    Args:
        policy_params: parameters of `make_ppo_networks(distribution_type="normal")`:
            hidden layers `MLP_0/hidden_i` and the mean head `Dense_0`. The noise has
            no part in the deterministic action and is left out.
        normalizer: Brax's running statistics (`mean`, `std`), per observation key or
            of the one observation.
        action_clip: bound that the environment puts on the output.
        obs_key: key of the actor's observation.

    Raises:
        ExportError: parameters of another architecture.
    """
    params = policy_params["params"]
    hidden = params.get("MLP_0", {})
    names = [f"hidden_{i}" for i in range(len(hidden))]
    if "Dense_0" not in params or not names or set(hidden) != set(names):
        found = ", ".join(sorted([*params, *hidden]))
        raise ExportError(
            f"policy parameters: found {found}; valid: MLP_0/hidden_i and Dense_0, "
            'of Brax PPO networks with distribution_type="normal" and no layer norm'
        )
    layers = [*(hidden[name] for name in names), params["Dense_0"]]
    return PolicyWeights(
        layers=tuple((_array(p["kernel"]), _array(p["bias"])) for p in layers),
        mean=_array(_select(normalizer.mean, obs_key)),
        std=_array(_select(normalizer.std, obs_key)),
        action_clip=action_clip,
    )


def brax_apply(
    network: Any, normalizer: Any, policy_params: Any, obs_key: str = "state"
) -> Apply:
    """Returns the mean action of Brax's policy network as a function of observations.

    Args:
        network: `PPONetworks.policy_network`.
        normalizer: Brax's running statistics.
        policy_params: parameters of the policy network.
        obs_key: key of the actor's observation.
    """
    host = jax.device_get((normalizer, policy_params))

    def apply(obs: Float[np.ndarray, "B N"]) -> Any:
        keyed = isinstance(host[0].mean, Mapping)
        return network.apply(*host, {obs_key: obs} if keyed else obs)[0]

    return apply


def _allowed(mean_action: Float[np.ndarray, "B A"]) -> Float[np.ndarray, " B"]:
    """Returns the largest difference allowed on each observation."""
    return PARITY_TOLERANCE * np.maximum(1, np.abs(mean_action).max(axis=1))


def _evaluate(apply: Apply, obs: Float[np.ndarray, "B N"]) -> Float[np.ndarray, "B A"]:
    """Runs JAX in full float32, to which GPUs do not default, row by row.

    On the hand the policy sees one observation at a time; the products of a whole batch
    are summed in another order, with about twice the rounding error.
    """
    rows = jax.jit(lambda batch: jax.lax.map(lambda row: apply(row[None])[0], batch))
    cpu = jax.devices("cpu")[0]
    with jax.default_matmul_precision("highest"), jax.default_device(cpu):
        return np.asarray(rows(obs), np.float32)


def _compare(
    name: str,
    found: Float[np.ndarray, "B A"],
    action: Float[np.ndarray, "B A"],
    allowed: Float[np.ndarray, " B"],
) -> float:
    """Returns the largest difference on a random observation, or refuses one."""
    difference = np.abs(found - action).max(axis=1)
    wrong = ~(difference <= allowed)
    if np.any(wrong):
        worst = int(np.argmax(wrong))
        raise ExportError(
            f"{name}: found actions {difference[worst]:.3g} off JAX's on observation "
            f"{worst} of {len(found)}; valid: at most {allowed[worst]:.3g}"
        )
    return float(difference[:OBSERVATIONS].max())


def _select(statistic: Any, obs_key: str) -> Any:
    return statistic[obs_key] if isinstance(statistic, Mapping) else statistic


def _array(value: Any) -> np.ndarray:
    return np.asarray(value, np.float32)
