import itertools
import sys
from pathlib import Path

import numpy as np
import pytest

from fingers_deploy.manifest import (
    Action,
    CommandPath,
    Interface,
    Normalizer,
    Observation,
    Provenance,
    Term,
)
from fingers_mjx.export.bundle import encode_bundle, write_bundle
from fingers_mjx.export.onnx_graph import PolicyWeights

# The measurements are tested as well: `hand_files`, `faults`, ….
sys.path.append(str(Path(__file__).parents[1] / "benchmarks"))

SEED = 20260


def make_interface() -> Interface:
    rng = np.random.default_rng(SEED)
    low = rng.uniform(-1.0, -0.1, 20)
    high = rng.uniform(0.1, 1.6, 20)
    reference = rng.uniform(low, high)
    return Interface(
        joint_names=tuple(
            f"finger{f}_joint{j}" for f in range(1, 6) for j in range(1, 5)
        ),
        reference_angles_rad=tuple(reference.tolist()),
        joint_limits_rad=tuple(zip(low.tolist(), high.tolist(), strict=True)),
        initial_target_rad=tuple(rng.uniform(low, high).tolist()),
        control_rate_hz=50.0,
        observation=Observation(
            terms=(
                Term("joint_pos", 20, "joint", "rad", 1.0, 8),
                Term("gravity_b", 3, "palm", "1", 1.0, 8),
                Term("angvel_b", 3, "palm", "rad/s", 0.25, 8),
                Term("previous_action", 20, "joint", "1", 1.0, 8),
                Term("command", 3, "V", "m/s m/s rad/s", 2.0, 8),
            )
        ),
        action=Action(scale_rad=0.06, clip=3.0),
        command_path=CommandPath(delay_s=0.02, lowpass_hz=3.0, slew_rad_s=None),
        command_ranges=((0.0, 0.16), (-0.16, 0.16), (-0.45, 0.45)),
        v_quat_b=(0.8, 0.0, -0.6, 0.0),
    )


def make_weights(sizes=(392, 32, 16, 20), action_clip=3.0, obs_clip=None):
    rng = np.random.default_rng(SEED)
    pairs = itertools.pairwise(sizes)
    layers = tuple(
        (
            (rng.standard_normal(pair) * np.sqrt(2 / pair[0])).astype(np.float32),
            (0.1 * rng.standard_normal(pair[1])).astype(np.float32),
        )
        for pair in pairs
    )
    mean = rng.normal(0, 0.5, sizes[0]).astype(np.float32)
    std = np.exp(rng.normal(0, 1, sizes[0])).astype(np.float32)
    return PolicyWeights(layers, mean, std, action_clip, obs_clip)


def reference_forward(weights: PolicyWeights, obs: np.ndarray) -> np.ndarray:
    """The formula in double precision."""
    x = (obs.astype(np.float64) - weights.mean) / weights.std
    if weights.obs_clip is not None:
        x = np.clip(x, -weights.obs_clip, weights.obs_clip)
    for weight, bias in weights.layers[:-1]:
        x = x @ weight.astype(np.float64) + bias
        x = np.where(x > 0, x, np.expm1(np.minimum(x, 0)))
    weight, bias = weights.layers[-1]
    return np.clip(x @ weight + bias, -weights.action_clip, weights.action_clip)


def make_bundle(interface=None, weights=None):
    weights = weights or make_weights()
    rng = np.random.default_rng(SEED + 1)
    units = rng.standard_normal((8, len(weights.mean)))
    obs = (weights.mean + weights.std * units).astype(np.float32)
    return encode_bundle(
        weights,
        "crawl",
        interface or make_interface(),
        Provenance(
            config_sha256="0123456789abcdef" * 4,
            normalizer=Normalizer(steps=1000, count=2**40),
            evaluation={"task_speed_mps": 0.1, "survival": 1.0},
            versions={"jax": "0.9.2", "fingers_mjx": "0.1.0"},
        ),
        (obs, reference_forward(weights, obs)),
    )


@pytest.fixture(scope="session")
def interface():
    return make_interface()


@pytest.fixture(scope="session")
def weights():
    return make_weights()


@pytest.fixture(scope="session")
def bundle():
    return make_bundle()


@pytest.fixture(scope="session")
def bundle_factory():
    """`make_bundle`, which conftest cannot export to tests in another way."""
    return make_bundle


@pytest.fixture(scope="session")
def weights_factory():
    return make_weights


@pytest.fixture
def bundle_dir(bundle, tmp_path):
    write_bundle(tmp_path / "bundle", bundle)
    return tmp_path / "bundle"


@pytest.fixture(scope="session")
def forward():
    return reference_forward


@pytest.fixture(scope="session")
def hand_model(tmp_path_factory):
    """The calibrated hand in its stance, as MJCF."""
    from hand_files import write_model

    return write_model(tmp_path_factory.mktemp("model") / "hand.xml")


@pytest.fixture(scope="session")
def marching():
    """A policy that marches in place on the calibrated hand."""
    from hand_files import marching_bundle

    return marching_bundle()


@pytest.fixture(scope="session")
def marching_dir(marching, tmp_path_factory):
    path = tmp_path_factory.mktemp("march") / "bundle"
    write_bundle(path, marching)
    return path
