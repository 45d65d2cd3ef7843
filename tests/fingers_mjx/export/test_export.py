from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from brax.training.acme import running_statistics, specs
from brax.training.agents.ppo import networks as ppo_networks

from fingers_deploy import load_bundle, load_policy
from fingers_deploy.manifest import (
    Action,
    CommandPath,
    Interface,
    Normalizer,
    Observation,
    Provenance,
    Term,
)
from fingers_mjx.export.export import (
    OBSERVATIONS,
    ExportError,
    brax_apply,
    brax_weights,
    export_policy,
    sample_observations,
)

SEED = 29
TERMS = (
    Term("joint_pos", 20, "joint", "rad", 1.0, 8),
    Term("gravity_b", 3, "palm", "1", 1.0, 8),
    Term("angvel_b", 3, "palm", "rad/s", 1.0, 8),
    Term("previous_action", 20, "joint", "1", 1.0, 8),
    Term("command", 3, "V", "m/s m/s rad/s", 1.0, 8),
)
INTERFACE = Interface(
    joint_names=tuple(f"finger{f}_joint{j}" for f in range(1, 6) for j in range(1, 5)),
    reference_angles_rad=(0.4,) * 20,
    joint_limits_rad=((-0.1, 1.6),) * 20,
    initial_target_rad=(0.5,) * 20,
    control_rate_hz=50.0,
    observation=Observation(TERMS),
    action=Action(scale_rad=0.06, clip=3.0),
    command_path=CommandPath(0.02, 3.0, None),
    command_ranges=((0.0, 0.16), (-0.16, 0.16), (-0.45, 0.45)),
    v_quat_b=(1.0, 0.0, 0.0, 0.0),
)
PROVENANCE = Provenance("0" * 64, Normalizer(1, 2), None, {"jax": "0.9.2"})
SIZES = {"state": (392,), "privileged_state": (437,)}


def _brax(distribution="normal", layer_norm=False, keyed=True, noise="scalar"):
    """A network of the paper's sizes with random biases and a normalizer that acts."""
    kwargs = {"noise_std_type": noise} if distribution == "normal" else {}
    networks = ppo_networks.make_ppo_networks(
        SIZES if keyed else 392,
        20,
        preprocess_observations_fn=running_statistics.normalize,
        policy_hidden_layer_sizes=(512, 256, 128),
        value_hidden_layer_sizes=(8,),
        activation=jax.nn.elu,
        distribution_type=distribution,
        **kwargs,
    )
    key = jax.random.PRNGKey(SEED)
    params = networks.policy_network.init(key)
    leaves, tree = jax.tree.flatten(params)
    keys = jax.random.split(key, len(leaves))
    leaves = [
        leaf + (0.1 * jax.random.normal(k, leaf.shape) if leaf.ndim == 1 else 0.0)
        for leaf, k in zip(leaves, keys, strict=True)
    ]
    sizes = SIZES if keyed else {"state": (392,)}
    nest = {name: specs.Array(size, jnp.float32) for name, size in sizes.items()}
    batch = {
        name: 0.5 + jnp.arange(1, size[0] + 1) % 7 * jax.random.normal(key, (64, *size))
        for name, size in sizes.items()
    }
    if not keyed:
        nest, batch = nest["state"], batch["state"]
    statistics = running_statistics.update(running_statistics.init_state(nest), batch)
    return networks.policy_network, statistics, jax.tree.unflatten(tree, leaves)


@pytest.fixture(scope="module")
def trained():
    network, statistics, params = _brax()
    # The output layer is scaled up until the clip of ±3 is reached as well.
    params["params"]["Dense_0"]["kernel"] *= 3.0
    weights = brax_weights(params, statistics, action_clip=3.0)
    return weights, jax.jit(brax_apply(network, statistics, params))


def _export(path, weights, apply):
    return export_policy(path, weights, apply, "crawl", INTERFACE, PROVENANCE)


def test_parity_on_4096_observations(trained, tmp_path):
    weights, apply = trained
    report = _export(tmp_path, weights, apply)
    assert report.observations >= OBSERVATIONS == 4096
    print(report)
    bundle = load_bundle(tmp_path)
    # An independent draw, through the files.
    obs = sample_observations(weights, SEED)[:256]
    wanted = np.clip(apply(obs), -3, 3)
    for runtime in ("numpy", "onnxruntime"):
        found = np.stack(list(map(load_policy(bundle, runtime), obs)))
        assert np.abs(found - wanted).max() <= 1e-5
    assert 0 < np.mean(np.abs(wanted) == 3.0) < 0.5
    assert len(bundle.manifest.parity.obs) == 8


def test_parity_on_ten_thousand_observations(trained, tmp_path):
    """T15: independent draws, extremes among them, through the files."""
    weights, apply = trained
    _export(tmp_path, weights, apply)
    obs = np.concatenate([sample_observations(weights, seed) for seed in range(3)])
    assert len(obs) >= 10_000
    policy = load_policy(load_bundle(tmp_path), "onnxruntime")
    found = np.stack(list(map(policy, obs)))
    wanted = np.asarray(apply(obs))
    size = np.maximum(1, np.abs(wanted).max(axis=1, keepdims=True))
    assert (np.abs(found - np.clip(wanted, -3, 3)) <= 1e-5 * size).all()
    assert np.isfinite(found).all() and size.max() > 3


def test_observations_reach_beyond_training(trained):
    weights, _ = trained
    obs = sample_observations(weights, 0)
    units = (obs - weights.mean) / weights.std
    assert np.abs(units[:OBSERVATIONS].mean()) < 0.01
    assert np.abs(units[:OBSERVATIONS].std() - 1) < 0.01
    assert np.abs(units[OBSERVATIONS:]).max() > 99


def _scaled(weights, factor):
    kernel, bias = weights.layers[-1]
    last = (factor * kernel, factor * bias)
    return replace(weights, layers=(*weights.layers[:-1], last))


def test_the_tolerance_grows_with_outputs_before_the_clip(trained, tmp_path):
    """After 900 M steps outputs reach 100; the clip cuts most, float32 rounds all."""
    weights, apply = trained
    scaled = _scaled(weights, 100.0)
    _export(tmp_path / "out", scaled, lambda obs: 100.0 * apply(obs))
    kernel, bias = scaled.layers[-1]
    wrong = replace(scaled, layers=(*scaled.layers[:-1], (kernel, bias + 0.01)))
    with pytest.raises(ExportError):
        _export(tmp_path / "wrong", wrong, lambda obs: 100.0 * apply(obs))


def _swap_joints(weights):
    order = [1, 0, *range(2, 20)]
    weight, bias = weights.layers[-1]
    last = (weight[:, order], bias[order])
    return replace(weights, layers=(*weights.layers[:-1], last))


WRONG = {
    "no mean": lambda w: replace(w, mean=np.zeros_like(w.mean)),
    "no std": lambda w: replace(w, std=np.ones_like(w.std)),
    "two joints swapped": _swap_joints,
    "another normalized clip": lambda w: replace(w, obs_clip=2.0),
    "a bias off by 3e-5": lambda w: replace(
        w, layers=(*w.layers[:-1], (w.layers[-1][0], w.layers[-1][1] + 3e-5))
    ),
    "NaN": lambda w: replace(w, mean=np.full_like(w.mean, np.nan)),
    "a layer less": lambda w: replace(w, layers=w.layers[1:]),
}


@pytest.mark.parametrize("name", WRONG)
def test_another_network_is_not_exported(trained, tmp_path, name):
    weights, apply = trained
    with pytest.raises(ExportError) as caught:
        _export(tmp_path / "out", WRONG[name](weights), apply)
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("keyed", [True, False])
@pytest.mark.parametrize("noise", ["scalar", "log"])
def test_weights_are_those_that_brax_applies(keyed, noise):
    network, statistics, params = _brax(keyed=keyed, noise=noise)
    weights = brax_weights(params, statistics, 3.0)
    obs = sample_observations(weights, SEED)[:64]
    x = (obs.astype(np.float64) - weights.mean) / weights.std
    for weight, bias in weights.layers[:-1]:
        x = np.asarray(jax.nn.elu(x @ weight + bias), np.float64)
    weight, bias = weights.layers[-1]
    found = brax_apply(network, statistics, params)(obs)
    np.testing.assert_allclose(found, x @ weight + bias, atol=1e-5)


def test_other_architectures_are_named():
    _, statistics, params = _brax(distribution="tanh_normal")
    with pytest.raises(ExportError, match="distribution_type"):
        brax_weights(params, statistics, 3.0)
    _, statistics, params = _brax()
    params["params"]["MLP_0"]["LayerNorm_0"] = {}
    with pytest.raises(ExportError, match="LayerNorm_0"):
        brax_weights(params, statistics, 3.0)
