"""Writing a policy bundle: `policy.onnx` and `manifest.json`, both or none."""

import hashlib
from pathlib import Path

import numpy as np
from jaxtyping import Float

from envs.config.atomic_file import write_atomic_set
from fingers_deploy.bundle import MANIFEST_FILE, POLICY_FILE, Bundle, decode_bundle
from fingers_deploy.manifest import (
    SCHEMA_VERSION,
    Interface,
    Manifest,
    Parity,
    PolicyGraph,
    Provenance,
    dump_manifest,
)
from fingers_mjx.export.onnx_graph import PolicyWeights, build_graph, embed_manifest


def encode_bundle(
    weights: PolicyWeights,
    task: str,
    interface: Interface,
    provenance: Provenance,
    parity: tuple[Float[np.ndarray, "K N"], Float[np.ndarray, "K A"]],
) -> Bundle:
    """Builds a bundle in memory and verifies it as a load would.

    Args:
        weights: normalizer, layers and clip.
        task: name of the task.
        interface: what the policy reads and what its output means.
        provenance: how it was made.
        parity: observations and the trained network's clipped actions for them.

    Raises:
        BundleError: parts that do not fit each other, values that are not finite, or
            a graph that does not give the actions of `parity`.
    """
    model = build_graph(weights)
    obs, action = (np.asarray(rows, np.float32) for rows in parity)
    manifest = Manifest(
        schema_version=SCHEMA_VERSION,
        task=task,
        policy=PolicyGraph(
            input="obs",
            output="action",
            obs_size=len(weights.mean),
            action_size=len(weights.layers[-1][1]),
            sha256=hashlib.sha256(model.SerializeToString()).hexdigest(),
        ),
        interface=interface,
        provenance=provenance,
        parity=Parity(_rows(obs), _rows(action)),
    )
    return decode_bundle(embed_manifest(model, manifest), POLICY_FILE)


def write_bundle(directory: str | Path, bundle: Bundle) -> None:
    """Writes the two files, each atomically.

    A process that dies in between leaves no half file; what it may leave is a policy
    beside the manifest of an older one, which every load refuses.

    Args:
        directory: made if missing; other files in it are left alone.
        bundle: what `encode_bundle` returned.

    Raises:
        OSError: the disk is full or not writable; nothing is left behind.
    """
    directory = Path(directory)
    directory.mkdir(parents=True, exist_ok=True)
    text = dump_manifest(bundle.manifest)
    write_atomic_set(
        {directory / POLICY_FILE: bundle.model, directory / MANIFEST_FILE: text}
    )


def _rows(array: np.ndarray) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(row) for row in array.tolist())
