"""Another hand, four fingers of three joints: from its MJCF to a policy that runs."""

import dataclasses
import importlib.util
import json
import re
from pathlib import Path

import jax
import mujoco
import numpy as np
import pytest
from support.few import FEW
from support.shim import differences, driven

from envs.errors import InputError
from envs.hand.hand_file import load_hand_file
from envs.hand.model import PHYSICS_DT_S, build_model
from envs.hand.nominal import vendor_hand
from envs.hand.spec import hand_spec
from envs.hand.stance import stance_of
from envs.randomize import no_randomization
from envs.registry import make_env as make_world
from fingers_deploy import BundleError, load_bundle
from fingers_mjx.cli.main import main
from fingers_mjx.runs.setup import make_env, run_setup
from fingers_robot.cli.main import main as robot

EXAMPLE = Path(__file__).parents[2] / "examples/second_hand"
JOINTS, HISTORY = 12, 8
SETTINGS = ("num_envs=8", *FEW)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with the imported hand."""
    made = tmp_path_factory.mktemp("second")
    files = [str(EXAMPLE / "small_hand.xml"), "--joint-map"]
    files += [str(EXAMPLE / "small_map.yaml"), "-o", str(made / "hand.yaml")]
    assert main(["hand", "import", *files, "--starts", "3"]) == 0
    return made


@pytest.fixture(scope="module")
def hand(folder):
    return load_hand_file(folder / "hand.yaml")


@pytest.fixture(scope="module")
def run(folder):
    path = folder / "run"
    argv = ["train", "crawl", "--preset", "cpu", "--hand", str(folder / "hand.yaml")]
    assert main([*argv, "--out", str(path), "--set", *SETTINGS]) == 0
    return path


@pytest.fixture(scope="module")
def bundle(run):
    assert main(["export", str(run)]) == 0
    return load_bundle(run)


def held(hand, target):
    """Height of the palm [m] and forces on the tips [N] after two seconds."""
    model, stance = build_model(hand), stance_of(hand)
    data = mujoco.MjData(model)
    data.qpos[:], data.ctrl[:] = stance.qpos, target
    for _ in range(round(2.0 / PHYSICS_DT_S)):
        mujoco.mj_step(model, data)
    spec = hand_spec(model)
    forces = [spec.read(data.sensordata, f"force_{tip}") for tip in spec.tip_spheres]
    return data.qpos[2], np.linalg.norm(forces, axis=1)


def test_it_stands_on_four_fingertips(hand):
    stance = stance_of(hand)
    assert len(stance.joint_pos_rad) == JOINTS and len(stance.footprint_v) == 4
    height, force_n = held(hand, stance.target_rad)
    assert height == pytest.approx(stance.root_pos_w[2], abs=2e-4)
    weight = 9.81 * build_model(hand).body_mass.sum()
    assert force_n.min() > 0.1 and force_n.sum() == pytest.approx(weight, rel=0.05)
    lower, _ = held(hand, np.zeros(JOINTS))
    assert abs(lower - height) > 0.01  # negative control: other targets, another pose


def test_it_trains(run):
    lines = (run / "metrics.jsonl").read_text("utf-8").splitlines()
    rows = [json.loads(line) for line in lines]
    terms = [name for name in rows[0] if name.startswith("reward/")]
    assert [row["iteration"] for row in rows] == [1, 2] and len(terms) >= 10
    assert np.isfinite([[row[name] for name in terms] for row in rows]).all()
    assert rows[-1]["policy/entropy"] != rows[0]["policy/entropy"]
    assert rows[-1]["invalid"] == 0.0


def test_the_manifest_is_of_this_hand(bundle, hand):
    interface = bundle.manifest.interface
    assert interface.joint_names == hand.nominal.joint_names
    assert bundle.manifest.policy.action_size == JOINTS
    assert bundle.manifest.policy.obs_size == HISTORY * (2 * JOINTS + 3 + 3 + 3)
    assert interface.slews_rad_s == (4.0,) * JOINTS


def swapped(measured):
    joints = np.array(measured["joint_pos"])
    joints[[1, 4]] = joints[[4, 1]]
    return measured | {"joint_pos": joints}


def test_the_shim_does_what_training_does(bundle, run):
    setup = run_setup(run)
    calm = dataclasses.replace(setup.env, randomize=no_randomization(0.88))
    env = make_env(dataclasses.replace(setup, env=calm), 1, "cpu").env
    states = driven((jax.jit(env.reset), jax.jit(env.step)), bundle, "numpy", 12)
    found = differences(bundle, "numpy", states)
    assert found["observation"] <= 1e-6 and found["target"] <= 1e-6
    assert found["action"] <= 1e-5
    assert np.ptp([s.obs["state"][:JOINTS] for s in states], axis=0).max() > 1e-3
    wrong = differences(bundle, "numpy", states, swapped)
    assert wrong["observation"] > 1e-3 and wrong["target"] > 1e-6


LEAP = {
    "training": ("task_speed_mps", "path_speed_mps", "turn_rate_error_rad_s"),
    "straight": ("path_speed_mps", "turn_rate_rad_s"),
    "left": ("path_speed_mps", "turn_rate_rad_s"),
    "right": ("path_speed_mps", "turn_rate_rad_s"),
}
"""What the example's page says of each evaluation."""


@pytest.mark.parametrize("name", LEAP)
def test_what_the_page_says_of_the_leap_hand_was_measured(name):
    shown = json.loads((EXAMPLE / f"leap_eval/{name}.json").read_text("utf-8"))
    bundle = load_bundle(EXAMPLE / "leap_policy")
    assert bundle.manifest.policy.action_size == 16
    assert shown["steps_trained"] == bundle.manifest.provenance.normalizer.steps
    text = (EXAMPLE / "README.md").read_text("utf-8").replace("\u2212", "-")
    means = [f"{shown['measures'][measure]['mean']:.3f}" for measure in LEAP[name]]
    row = r" \|.*[| +]".join(re.escape(mean) for mean in means)
    assert re.search(row, text, re.DOTALL if name == "training" else 0)


def test_what_is_made_for_another_hand_refuses_it(bundle, hand, run, capsys):
    with pytest.raises(BundleError, match="12 joints"):
        load_bundle(run, vendor_hand().joint_names)
    with pytest.raises(InputError, match=r"12 joints.*20 joints"):
        make_world("recovery", hand=hand)
    with pytest.raises(InputError, match="the vendor's dimensions"):
        make_world("keyboard", hand=hand)
    bare = dataclasses.replace(hand, stance=None)
    with pytest.raises(InputError, match="a stance of its own for 12 joints"):
        stance_of(bare)
    capsys.readouterr()
    argv = ["run", str(run), "--driver", "sim", "--socket", "none", "--sticks", "0"]
    assert robot(argv) == 2
    assert "12 joints" in capsys.readouterr().err


@pytest.mark.slow
def test_the_script_does_all_of_it(folder, monkeypatch):
    spec = importlib.util.spec_from_file_location("walk", EXAMPLE / "walk.py")
    walk = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(walk)
    out = folder / "all"
    argv = [str(folder / "hand.yaml"), "--out", str(out), "--episodes", "2"]
    assert walk.main([*argv, "--seconds", "0.5", "--set", *SETTINGS]) == 0
    made = ("stance/left.png", "curve.png", "bundle/policy.onnx", "eval.json")
    assert [
        name for name in (*made, "walk.webp") if not (out / name).stat().st_size
    ] == []
    assert walk.main(argv) == 0  # all is there
    (out / "curve.png").unlink()
    monkeypatch.setattr(walk, "fingers", lambda arguments: 1)  # nothing is trained
    assert walk.main(argv) == 0 and (out / "curve.png").exists()
    (out / "eval.json").unlink()
    assert walk.main(argv) == 1
