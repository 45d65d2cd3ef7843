import builtins

import numpy as np
import pytest

from fingers_deploy import BundleError, NumpyPolicy, OnnxPolicy, load_policy

SEED = 11


@pytest.mark.parametrize("obs_clip", [None, 1.5])
@pytest.mark.parametrize("runtime", ["numpy", "onnxruntime"])
def test_both_runtimes_follow_the_formula(
    bundle_factory, weights_factory, forward, runtime, obs_clip
):
    weights = weights_factory(obs_clip=obs_clip)
    policy = load_policy(bundle_factory(weights=weights), runtime)
    rng = np.random.default_rng(SEED)
    units = 2 * rng.standard_normal((1000, 392))
    obs = (weights.mean + weights.std * units).astype(np.float32)
    found, wanted = np.stack([policy(o) for o in obs]), forward(weights, obs)
    assert found.dtype == np.float32 and found.shape == (1000, 20)
    assert np.abs(found - wanted).max() <= 1e-5
    # The test must be able to fail: saturation hides nothing, the clip is reached.
    assert 0.001 < np.mean(np.abs(wanted) == 3.0) < 0.5
    shuffled = forward(weights, np.roll(obs, 1, axis=1))
    assert np.abs(found - shuffled).max() > 0.1


def test_auto_takes_numpy_where_onnxruntime_is_missing(bundle, monkeypatch):
    assert isinstance(load_policy(bundle), OnnxPolicy)
    plain = builtins.__import__

    def refuse(name, *args, **kwargs):
        if name == "onnxruntime":
            raise ImportError(name)
        return plain(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", refuse)
    assert isinstance(load_policy(bundle), NumpyPolicy)
    with pytest.raises(BundleError, match="no ONNX Runtime"):
        load_policy(bundle, "onnxruntime")


def test_unknown_runtime_is_refused(bundle):
    with pytest.raises(BundleError, match="torch"):
        load_policy(bundle, "torch")


def test_overflow_is_silent_and_visible(bundle, recwarn):
    obs = np.full(392, np.finfo(np.float32).max, np.float32)
    bundle.network(obs)
    assert not recwarn.list
