"""Run an exported policy bundle: numpy, with ONNX Runtime where it is installed.

A name is imported when it is first used: reading files and errors takes no NumPy.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fingers_deploy.action import ActionTransform as ActionTransform
    from fingers_deploy.bundle import Bundle as Bundle
    from fingers_deploy.bundle import load_bundle as load_bundle
    from fingers_deploy.controller import PolicyController as PolicyController
    from fingers_deploy.errors import BundleError as BundleError
    from fingers_deploy.manifest import Manifest as Manifest
    from fingers_deploy.network import NumpyPolicy as NumpyPolicy
    from fingers_deploy.observation import ObservationAssembler as ObservationAssembler
    from fingers_deploy.policy import OnnxPolicy as OnnxPolicy
    from fingers_deploy.policy import load_policy as load_policy

_PLACES = (
    "action.ActionTransform bundle.Bundle bundle.load_bundle errors.BundleError "
    "controller.PolicyController manifest.Manifest network.NumpyPolicy "
    "observation.ObservationAssembler policy.OnnxPolicy policy.load_policy"
)
_HOMES = {name: home for home, name in (p.split(".") for p in _PLACES.split())}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_HOMES[name]}"), name)
