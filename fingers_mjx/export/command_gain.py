"""From a policy to the bundle of one that is shown its command times a gain."""

import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import jax.numpy as jnp
import numpy as np

from envs.errors import InputError
from fingers_mjx.export.export import ExportReport, export_policy
from fingers_mjx.export.onnx_graph import PolicyWeights
from fingers_mjx.export.run import copy_setup, export_run
from fingers_mjx.policy.actor import act
from fingers_mjx.policy.command_gain import with_command_gain
from fingers_mjx.policy.place import is_run
from fingers_mjx.policy.source import load_bundle_setup


def export_with_gain(path: Path, out_dir: Path, gain: Sequence[float]) -> ExportReport:
    """Writes the bundle of a policy that is shown its command times a gain.

    What the policy was trained in and for how long stays; an evaluation of it does not,
    since it was of the policy without the gain.

    Args:
        path: run directory, whose newest checkpoint it is, bundle directory or the
            bundle's ONNX file.
        out_dir: another directory, made if missing.
        gain: factor of each entry of the command (`with_command_gain`) [1].

    Raises:
        InputError: no policy, or one without such a command.
        BundleError: a bundle that is damaged or made for another hand.
        ExportError: the exported graph gives other actions than JAX.
    """
    if not is_run(path):
        return _with_gain(path, out_dir, gain)
    with tempfile.TemporaryDirectory(prefix="fingers-") as folder:
        newest = Path(folder) / path.absolute().name
        export_run(path, newest)
        return _with_gain(newest, out_dir, gain)


def _with_gain(path: Path, out_dir: Path, gain: Sequence[float]) -> ExportReport:
    bundle, setup = load_bundle_setup(path)
    if np.isfinite(bundle.network.obs_clip):
        found, valid = "a clip of the observation", "a policy of fingers export"
        raise InputError(path, "graph", found, valid)
    manifest = bundle.manifest
    network = with_command_gain(bundle.network, manifest.interface, gain)
    report = export_policy(
        out_dir,
        PolicyWeights(network.layers, network.mean, network.std, network.action_clip),
        lambda obs: act(network, jnp.asarray(obs)),
        setup.train.task,
        manifest.interface,
        replace(manifest.provenance, evaluation=None),
    )
    copy_setup(path if path.is_dir() else path.parent, out_dir)
    return report
