"""A policy that is shown more than is asked, where it falls short of commands."""

from collections.abc import Sequence
from dataclasses import replace

from envs.errors import InputError
from fingers_deploy.manifest import Interface
from fingers_deploy.network import NumpyPolicy
from fingers_mjx.policy.interface import entry_factors


def with_command_gain(
    network: NumpyPolicy, interface: Interface, gain: Sequence[float]
) -> NumpyPolicy:
    """Returns the policy that sees γ·c where the given one sees the command c.

    (γ c − μ) / σ = (c − μ/γ) / (σ/γ), so the normalizer takes the gain and nothing else
    changes. The usual static feedforward, of a drive's speed as of a walking hand's.

    Args:
        network: of a bundle.
        interface: of the same bundle.
        gain: γ, one factor above zero for each entry of the command [1].

    Raises:
        InputError: a policy without a command of so many entries.

    Source:
        Ours.
    """
    sizes = {term.name: term.size for term in interface.observation.terms}
    if sizes.get("command") != len(gain):
        found = ", ".join(f"{name} ({size})" for name, size in sizes.items())
        valid = f"a policy that sees a command of {len(gain)} entries"
        raise InputError("observation", "terms", found, valid)
    scale = entry_factors(interface, "command", gain).astype(network.mean.dtype)
    return replace(network, mean=network.mean / scale, std=network.std / scale)
