import hashlib
import json

import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper

from fingers_deploy import BundleError, PolicyController, load_bundle
from fingers_deploy.bundle import (
    MANIFEST_KEY,
    check_joint_order,
    check_parity,
    decode_bundle,
    seal,
)

SEED = 7
FLIPS = 300


def _unsealed(bundle):
    model = onnx.load_from_string(bundle.model)
    assert model.metadata_props.pop().key == "file_sha256"
    return model


def _forge(bundle, change, manifest_change=None):
    """A changed model whose checksums are right again."""
    model = _unsealed(bundle)
    change(model)
    kept = {p.key: p.value for p in model.metadata_props}
    del model.metadata_props[:]
    table = json.loads(kept[MANIFEST_KEY])
    table["policy"]["sha256"] = hashlib.sha256(model.SerializeToString()).hexdigest()
    if manifest_change:
        manifest_change(table)
    kept[MANIFEST_KEY] = json.dumps(table)
    helper.set_model_props(model, kept)
    return seal(model.SerializeToString())


def _refusal(data):
    with pytest.raises(BundleError) as caught:
        decode_bundle(data, "policy.onnx")
    assert "\n" not in str(caught.value)
    return caught.value


def test_directory_and_file_give_the_same_bundle(bundle, bundle_dir):
    whole, single = load_bundle(bundle_dir), load_bundle(bundle_dir / "policy.onnx")
    assert whole.manifest == single.manifest == bundle.manifest
    assert whole.model == single.model == bundle.model


def test_onnx_reads_the_sealed_file(bundle):
    onnx.checker.check_model(onnx.load_from_string(bundle.model), full_check=True)


def test_every_bit_flip_is_refused(bundle):
    rng = np.random.default_rng(SEED)
    for position in rng.integers(0, 8 * len(bundle.model), FLIPS):
        data = bytearray(bundle.model)
        data[position // 8] ^= 1 << (position % 8)
        assert "SHA-256" in str(_refusal(bytes(data)))


def test_every_bit_of_the_checksum_entry_counts(bundle):
    for position in range(8 * len(seal(b""))):
        data = bytearray(bundle.model)
        data[-1 - position // 8] ^= 1 << (position % 8)
        _refusal(bytes(data))


def test_every_truncation_is_refused(bundle):
    rng = np.random.default_rng(SEED)
    for length in [0, 1, *rng.integers(0, len(bundle.model), 100)]:
        _refusal(bundle.model[:length])
    _refusal(bundle.model + b"\0")


def test_manifest_changes_beside_the_policy_are_refused(bundle_dir):
    path = bundle_dir / "manifest.json"
    text = path.read_bytes()
    rng = np.random.default_rng(SEED)
    for position in rng.integers(0, 8 * len(text), FLIPS // 3):
        data = bytearray(text)
        data[position // 8] ^= 1 << (position % 8)
        path.write_bytes(bytes(data))
        with pytest.raises(BundleError, match=r"manifest\.json"):
            load_bundle(bundle_dir)
    path.write_bytes(text)
    load_bundle(bundle_dir)


def test_another_policy_with_the_same_shapes_is_refused(
    bundle_dir, bundle_factory, weights_factory
):
    other = bundle_factory(weights=weights_factory(obs_clip=5.0))
    (bundle_dir / "policy.onnx").write_bytes(other.model)
    with pytest.raises(BundleError, match="another manifest"):
        load_bundle(bundle_dir)


def test_a_policy_that_runs_does_not_see_its_file_change(bundle_dir, bundle):
    """S16: read once; swapped, cut or overwritten in place, the old one goes on."""
    path = bundle_dir / "policy.onnx"
    for runtime in ("onnxruntime", "numpy"):
        path.write_bytes(bundle.model)
        running = PolicyController(load_bundle(bundle_dir), runtime)
        undisturbed = PolicyController(bundle, runtime)
        rng = np.random.default_rng(SEED)
        for k in range(20):
            if k == 10:
                with path.open("r+b") as file:
                    file.write(rng.bytes(len(bundle.model) // 2))
                    file.truncate()
            pos, gyro = rng.normal(0, 0.1, 20), rng.normal(0, 0.1, 3)
            found, wanted = (
                c.step(pos, [0.0, 0.0, -1.0], gyro, [0.1, 0.0, 0.0])
                for c in (running, undisturbed)
            )
            np.testing.assert_array_equal(found, wanted)
        with pytest.raises(BundleError):
            load_bundle(bundle_dir)


def test_missing_files_are_named(tmp_path, bundle_dir):
    with pytest.raises(BundleError, match="nowhere"):
        load_bundle(tmp_path / "nowhere")
    (bundle_dir / "manifest.json").unlink()
    with pytest.raises(BundleError, match=r"manifest\.json"):
        load_bundle(bundle_dir)
    (bundle_dir / "policy.onnx").unlink()
    with pytest.raises(BundleError, match=r"policy\.onnx"):
        load_bundle(bundle_dir)


def test_another_joint_order_is_refused(bundle_dir, interface):
    names = interface.joint_names
    load_bundle(bundle_dir, joint_names=names)
    swapped = (names[0], names[2], names[1], *names[3:])
    with pytest.raises(BundleError, match=r"joint_names\[1\].*finger1_joint3"):
        load_bundle(bundle_dir, joint_names=swapped)
    with pytest.raises(BundleError, match="21 joints"):
        check_joint_order(load_bundle(bundle_dir), [*names, "extra"])


def _external(model):
    tensor = model.graph.initializer[2]
    tensor.data_location = TensorProto.EXTERNAL
    tensor.external_data.add(key="location", value="../../etc/passwd")
    tensor.ClearField("raw_data")


def _nan(model):
    tensor = model.graph.initializer[2]
    tensor.raw_data = b"\x00\x00\xc0\x7f" + tensor.raw_data[4:]


def _doubles(model):
    tensor = model.graph.initializer[0]
    tensor.data_type = TensorProto.DOUBLE


def _custom(model):
    model.graph.node[3].domain = "com.example"


def _attribute(model):
    model.graph.node[3].attribute.append(helper.make_attribute("alpha", 2.0))


def _no_normalizer(model):
    del model.graph.node[0]
    model.graph.node[0].input[0] = "obs"


def _zero_std(model):
    tensor = model.graph.initializer[1]
    tensor.raw_data = bytes(len(tensor.raw_data))


def _wide_input(model):
    model.graph.input[0].type.tensor_type.shape.dim[1].dim_value = 393


def _second_input(model):
    model.graph.input.append(model.graph.input[0])


def _bypass(model):
    model.graph.node[2].input[0] = "obs"


FORGED = {
    "external data": _external,
    "NaN weights": _nan,
    "other dtype": _doubles,
    "custom operator": _custom,
    "attribute": _attribute,
    "no normalizer": _no_normalizer,
    "zero deviation": _zero_std,
    "input size": _wide_input,
    "two inputs": _second_input,
    "bypass": _bypass,
    "IR 14": lambda m: setattr(m, "ir_version", 14),
    "opset 28": lambda m: setattr(m.opset_import[0], "version", 28),
    "domain": lambda m: setattr(m.opset_import[0], "domain", "ai.onnx.ml"),
    "function": lambda m: m.functions.add(),
    "tanh": lambda m: setattr(m.graph.node[3], "op_type", "Tanh"),
    "cut tensor": lambda m: setattr(m.graph.initializer[2], "raw_data", b"1234"),
    "dimension": lambda m: m.graph.initializer[2].dims.append(-(2**62)),
    "no output": lambda m: m.graph.ClearField("output"),
    "unused": lambda m: m.graph.initializer.add().CopyFrom(
        helper.make_tensor("x", TensorProto.FLOAT, [1], b"1234", raw=True)
    ),
}


@pytest.mark.parametrize("name", FORGED)
def test_forged_graphs_are_refused_by_what_they_are(bundle, name):
    assert _refusal(_forge(bundle, FORGED[name])).field == "graph"


def test_the_forger_itself_is_sound(bundle):
    decode_bundle(_forge(bundle, lambda model: None), "policy.onnx")


def test_another_network_fails_its_own_known_answers(bundle):
    def change(model):
        tensor = model.graph.initializer[2]
        tensor.raw_data = np.roll(np.frombuffer(tensor.raw_data, "<f4"), 1).tobytes()

    assert _refusal(_forge(bundle, change)).field.startswith("parity.action")


@pytest.mark.parametrize(
    ("section", "key", "value"),
    [("policy", "sha256", "0" * 64), ("interface", "action", None)],
)
def test_a_manifest_for_another_graph_is_refused(bundle, section, key, value):
    def change(table):
        other = {**table["interface"]["action"], "clip": 2.0}
        table[section][key] = value or other

    error = _refusal(_forge(bundle, lambda model: None, change))
    assert error.field.startswith(f"{section}.{key}")


def test_no_manifest_inside_is_refused(bundle):
    model = _unsealed(bundle)
    del model.metadata_props[:]
    assert _refusal(seal(model.SerializeToString())).field == "metadata"


def test_noise_behind_a_right_checksum_is_refused():
    rng = np.random.default_rng(SEED)
    for length in range(200):
        _refusal(seal(rng.bytes(length)))


def test_parity_has_a_threshold(bundle):
    check_parity(bundle, lambda obs: bundle.network(obs) + np.float32(5e-6))
    with pytest.raises(BundleError, match="off"):
        check_parity(bundle, lambda obs: bundle.network(obs) + np.float32(5e-5))
    with pytest.raises(BundleError, match="nan"):
        check_parity(bundle, lambda obs: np.full(20, np.nan, np.float32))
