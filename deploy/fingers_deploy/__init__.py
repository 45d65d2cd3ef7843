"""Run an exported policy bundle: numpy, with ONNX Runtime where it is installed."""

from fingers_deploy.action import ActionTransform
from fingers_deploy.bundle import Bundle, load_bundle
from fingers_deploy.controller import PolicyController
from fingers_deploy.errors import BundleError
from fingers_deploy.manifest import Manifest
from fingers_deploy.network import NumpyPolicy
from fingers_deploy.observation import ObservationAssembler
from fingers_deploy.policy import OnnxPolicy, load_policy

__all__ = [
    "ActionTransform",
    "Bundle",
    "BundleError",
    "Manifest",
    "NumpyPolicy",
    "ObservationAssembler",
    "OnnxPolicy",
    "PolicyController",
    "load_bundle",
    "load_policy",
]
