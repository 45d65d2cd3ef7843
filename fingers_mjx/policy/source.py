"""A trained policy with the task and the hand it was trained for.

Read from a run directory (its newest checkpoint) or from an exported bundle, beside
which `config.yaml` and `hand.yaml` say what it was trained in.
"""

from dataclasses import dataclass
from pathlib import Path

from fingers_deploy import Bundle
from fingers_mjx.policy.actor import Network, load_policy
from fingers_mjx.policy.interface import (
    check_interface,
    check_run_interface,
    interface_of,
)
from fingers_mjx.policy.place import is_run
from fingers_mjx.policy.trained_in import read_bundle
from fingers_mjx.runs.setup import Setup, make_env, run_setup


@dataclass(frozen=True)
class PolicySource:
    """A policy and what it was trained in.

    Attributes:
        path: as the user gave it.
        setup: settings and hand of the training.
        network: normalizer and layers.
        steps_trained: control steps of all worlds behind it.
    """

    path: Path
    setup: Setup
    network: Network
    steps_trained: int

    @property
    def name(self) -> str:
        """The end of the path: results do not mention where the policy lies."""
        path = self.path.absolute()
        return f"{path.parent.name}/{path.name}" if path.suffix else path.name


def load_source(path: Path) -> PolicySource:
    """Reads a policy from wherever training or export has put it.

    Args:
        path: run directory, bundle directory or the bundle's ONNX file.

    Raises:
        InputError: neither of them, or files that do not belong together.
        BundleError: a bundle that is damaged or made for another hand.
    """
    if is_run(path):
        setup, policy = run_setup(path), load_policy(path)
        check_run_interface(path, make_env(setup, 1, "cpu"))
        return PolicySource(path, setup, policy, policy.meta["env_steps"])
    bundle, setup = load_bundle_setup(path)
    steps = bundle.manifest.provenance.normalizer.steps
    return PolicySource(path, setup, bundle.network, steps)


def load_bundle_setup(path: Path) -> tuple[Bundle, Setup]:
    """Reads a bundle with the settings and the hand that were exported with it.

    Raises:
        InputError: no bundle; files beside it that are missing, not those of its
            export, or of a task that has changed since.
        BundleError: a bundle that is damaged or made for another hand.
    """
    bundle, setup = read_bundle(path)
    ours = interface_of(make_env(setup, 1, "cpu"))
    check_interface(bundle.source, bundle.manifest.interface, ours)
    return bundle, setup
