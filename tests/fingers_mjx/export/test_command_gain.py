"""A policy exported with a gain of its command."""

from pathlib import Path

import numpy as np
import pytest
from support.cli_setup import make_run, make_setup

from fingers_deploy import load_bundle
from fingers_mjx.cli.main import main
from fingers_mjx.export.command_gain import export_with_gain
from fingers_mjx.policy.source import load_source

POLICY = Path("benchmarks/claims/policies/steering_planted")
GAIN = ("1.2", "1.2", "1")


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    out = tmp_path_factory.mktemp("gain") / "policy"
    assert (
        main(["export", str(POLICY), "--command-gain", *GAIN, "--out", str(out)]) == 0
    )
    return out


def test_the_bundle_is_whole_and_remembers_its_training(exported):
    before, after = load_source(POLICY), load_source(exported)

    assert after.setup == before.setup
    assert after.steps_trained == before.steps_trained


def test_only_the_normalizer_of_the_command_differs(exported):
    before, after = load_bundle(POLICY), load_bundle(exported)

    np.testing.assert_array_equal(after.network.mean[:-24], before.network.mean[:-24])
    ratio = before.network.std[-24:] / after.network.std[-24:]
    np.testing.assert_allclose(ratio, np.tile([1.2, 1.2, 1.0], 8), rtol=1e-6)
    for ours, theirs in zip(after.network.layers, before.network.layers, strict=True):
        np.testing.assert_array_equal(ours[0], theirs[0])


def test_an_evaluation_of_the_policy_without_the_gain_is_left_out(exported):
    assert load_bundle(POLICY).manifest.provenance.evaluation is not None
    assert load_bundle(exported).manifest.provenance.evaluation is None


def test_the_onnx_file_may_be_named(exported, tmp_path):
    export_with_gain(POLICY / "policy.onnx", tmp_path / "out", (1.2, 1.2, 1.0))

    assert (tmp_path / "out/policy.onnx").read_bytes() == (
        exported / "policy.onnx"
    ).read_bytes()


def test_of_a_run_the_newest_checkpoint_is_taken(tmp_path):
    """Not the policy that an export has left there."""
    run = make_run(tmp_path / "run", make_setup())
    (run / "policy.onnx").write_bytes(b"older")

    export_with_gain(run, tmp_path / "out", (2.0, 2.0, 1.0))

    assert load_source(tmp_path / "out").setup == load_source(run).setup


@pytest.mark.parametrize("name", ["", "policy.onnx"])
def test_a_policy_is_not_written_over(name, exported, capsys):
    words = ["--command-gain", *GAIN, "--out", str(exported)]
    status = main(["export", str(exported / name), *words])

    assert status == 2
    assert "the policy would be lost" in capsys.readouterr().err
