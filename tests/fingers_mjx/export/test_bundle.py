import errno
import json
import os
import stat
from dataclasses import replace
from pathlib import Path

import numpy as np
import onnx
import pytest

from fingers_deploy import BundleError, load_bundle
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

SEED = 23
INTERFACE = Interface(
    joint_names=tuple(f"finger{f}_joint{j}" for f in range(1, 6) for j in range(1, 5)),
    reference_angles_rad=(1 / 3,) * 20,
    joint_limits_rad=((-0.1, 1.6),) * 20,
    initial_target_rad=(0.5,) * 20,
    control_rate_hz=50.0,
    observation=Observation((Term("joint_pos", 20, "joint", "rad", 1.0, 2),)),
    action=Action(scale_rad=0.06, clip=3.0),
    command_path=CommandPath(0.02, 3.0, None),
    command_ranges=(),
    v_quat_b=(1.0, 0.0, 0.0, 0.0),
)
PROVENANCE = Provenance("0" * 64, Normalizer(1, 2), None, {"jax": "0.9.2"})


def _weights(seed=SEED):
    rng = np.random.default_rng(seed)
    layer = rng.standard_normal((40, 20)), rng.standard_normal(20)
    return PolicyWeights((layer,), rng.standard_normal(40), np.full(40, 2.0), 3.0)


def _parity(weights):
    obs = np.random.default_rng(SEED).standard_normal((8, 40)).astype(np.float32)
    weight, bias = weights.layers[0]
    return obs, np.clip((obs - weights.mean) / weights.std @ weight + bias, -3, 3)


def _bundle(weights=None, interface=INTERFACE, provenance=PROVENANCE):
    weights = weights or _weights()
    return encode_bundle(weights, "crawl", interface, provenance, _parity(weights))


def test_written_files_load_and_are_readable_by_all(tmp_path):
    written = _bundle()
    (tmp_path / "config.yaml").write_text("kept")
    previous = os.umask(0o077)
    try:
        write_bundle(tmp_path, written)
    finally:
        os.umask(previous)
    assert load_bundle(tmp_path).manifest == written.manifest
    names = {"config.yaml", "policy.onnx", "manifest.json"}
    assert {path.name for path in tmp_path.iterdir()} == names
    for name in ("policy.onnx", "manifest.json"):
        assert stat.S_IMODE((tmp_path / name).stat().st_mode) == 0o644


def test_mjlab_keys_are_written_at_full_precision(tmp_path):
    model = onnx.load_from_string(_bundle().model)
    metadata = {p.key: p.value for p in model.metadata_props}
    assert metadata["joint_names"].split(",") == list(INTERFACE.joint_names)
    values = [float(v) for v in metadata["default_joint_pos"].split(",")]
    assert values == [1 / 3] * 20
    assert metadata["observation_terms_history_length"] == "2"


def test_nothing_about_the_machine_is_written():
    table = json.loads(
        {p.key: p.value for p in onnx.load_from_string(_bundle().model).metadata_props}[
            "manifest"
        ]
    )
    text = json.dumps(table) + _bundle().model.decode("latin-1")
    for secret in (os.uname().nodename, os.getcwd(), "/home", "/root", "/tmp"):
        assert secret not in text


def test_same_input_same_bytes():
    assert _bundle().model == _bundle().model


@pytest.mark.parametrize("step", ["fsync", "chmod"])
def test_a_full_disk_leaves_the_old_bundle(tmp_path, monkeypatch, step):
    write_bundle(tmp_path, _bundle())
    old = {p.name: p.read_bytes() for p in tmp_path.iterdir()}

    def full(*_, **__):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, step, full)
    with pytest.raises(OSError, match="No space left"):
        write_bundle(tmp_path, _bundle(_weights(1)))
    assert {p.name: p.read_bytes() for p in tmp_path.iterdir()} == old


@pytest.mark.parametrize("crash_at", [1, 2])
def test_a_crash_between_the_renames_is_never_a_mixed_bundle(
    tmp_path, monkeypatch, crash_at
):
    write_bundle(tmp_path, _bundle())
    calls, plain = [], Path.replace

    def crash(self, target):
        calls.append(target)
        if len(calls) == crash_at:
            raise KeyboardInterrupt
        return plain(self, target)

    monkeypatch.setattr(Path, "replace", crash)
    with pytest.raises(KeyboardInterrupt):
        write_bundle(tmp_path, _bundle(_weights(1)))
    monkeypatch.undo()
    assert len(list(tmp_path.iterdir())) == 2
    if crash_at == 1:
        assert load_bundle(tmp_path).manifest == _bundle().manifest
    else:
        with pytest.raises(BundleError, match="another manifest"):
            load_bundle(tmp_path)
        assert load_bundle(tmp_path / "policy.onnx").model == _bundle(_weights(1)).model


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"control_rate_hz": float("nan")}, "control_rate_hz"),
        # The names say how many joints there are; the angles are one too many.
        ({"joint_names": INTERFACE.joint_names[:19]}, "reference_angles_rad"),
        ({"action": Action(0.06, 2.5)}, "action.clip"),
        ({"observation": Observation(())}, "observation.terms"),
    ],
    ids=["nan", "joints", "clip", "terms"],
)
def test_parts_that_do_not_fit_are_refused(change, field):
    with pytest.raises(BundleError, match=field.replace(".", r"\.")):
        _bundle(interface=replace(INTERFACE, **change))


def test_answers_of_another_network_are_refused():
    other = _parity(_weights(1))
    with pytest.raises(BundleError, match="parity"):
        encode_bundle(_weights(), "crawl", INTERFACE, PROVENANCE, other)
