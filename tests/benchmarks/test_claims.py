"""The sweeps that test the paper's claims can begin, and differ in rewards alone."""

import json
import re
from pathlib import Path

import pytest

from benchmarks.claims.claims import WALKS_MPS
from envs.config.typed import load_yaml
from envs.hand.hand_file import hand_yaml, load_hand_file
from fingers_mjx.cli.main import make_parser
from fingers_mjx.studies.sweep.resolve import keep_sweep
from fingers_mjx.studies.sweep.spec import Sweep

CLAIMS = Path(__file__).resolve().parents[2] / "benchmarks/claims"
MEMBERS = {
    "ablation": (6, 12),
    "tuned_stock": (24, 2),
    "weights": (8, 6),
    "steering": (4, 2),
    "steering_walker": (2, 2),
    "steering_sideways": (2, 2),
    "push_effort": (2, 1),
    "keyboard_creep": (6, 1),
    "keyboard_planted": (3, 1),
    "keyboard_shear": (4, 1),
    "keyboard_still": (2, 2),
    "keyboard_stiller": (2, 2),
    "steering_doubled": (2, 2),
    "steering_long": (2, 1),
    "steering_speed": (2, 2),
    "steering_planted": (2, 2),
    "steering_task_speed": (2, 2),
    "steering_all_dearer": (2, 2),
    "steering_turns_kept": (2, 2),
    "steering_quieter": (2, 2),
    "diagnosis_gain": (3, 8),
    "budget_fourth": (2, 6),
}
HANDS = sorted(CLAIMS.glob("hands/*.yaml"))
MADE = {
    "deadband": "sysid diagnose deadband/finger.parquet -o deadband/diagnosis",
    "deadband_real": "benchmarks.diagnosis.hidden_deadband --out deadband",
    "weak_finger_real": 'save_hand_file(hand, "weak_finger_real.yaml")',
}
"""The command of each hand, at its top."""


def swept(name):
    return load_yaml(Sweep, CLAIMS / f"{name}.yaml")


@pytest.mark.usefixtures("every_backend")
@pytest.mark.parametrize("name", MEMBERS)
def test_the_sweeps_can_begin(tmp_path, name):
    made = keep_sweep(swept(name), CLAIMS / f"{name}.yaml", tmp_path)
    configurations, seeds = MEMBERS[name]
    assert (len(made.configurations), len(made.seeds)) == (configurations, seeds)


def test_the_fourth_budget_differs_in_what_it_names():
    spec, after = swept("budget_fourth"), swept("ablation")
    chosen = {"num_envs": after.set["num_envs"]}
    assert dict(spec.set) | chosen == dict(after.set)
    assert int(after.set["num_envs"]) == 2 * int(spec.set["num_envs"])
    assert spec.evaluate == after.evaluate
    assert spec.configurations == {
        "more_worlds": chosen,
        "less_noise": {"ppo.entropy_cost": 0.001},
    }
    assert spec.seeds == swept("budget").seeds
    assert min(spec.seeds) >= after.seeds


def test_the_fourth_budget_was_chosen_by_its_rule():
    results = CLAIMS.parent / "results/budget_fourth"
    speeds = {
        file.stem: measures["task_speed_mps"]["mean"]
        for file in sorted(results.glob("*-*.json"))
        for measures in [json.loads(file.read_text("utf-8"))["measures"]]
    }
    assert speeds.keys() >= {f"more_worlds-{seed}" for seed in range(100, 106)}
    walks = {name for name, speed in speeds.items() if speed >= WALKS_MPS}
    assert sum(name.startswith("more_worlds") for name in walks) >= 5
    assert sum(name.startswith("less_noise") for name in speeds.keys() - walks) >= 1


def test_only_the_hand_differs():
    spec = swept("diagnosis_gain")
    assert dict(spec.set) == dict(swept("ablation").set) | {"on_overflow": "warn"}
    assert spec.evaluate == swept("ablation").evaluate
    assert all(set(c) <= {"hand"} for c in spec.configurations.values())
    for name in ("deadband", "weak_finger"):
        paths = (spec.configurations[name]["hand"], f"hands/{name}_real.yaml")
        found, real = (load_hand_file(CLAIMS / str(path)) for path in paths)
        for ours, theirs in zip(found.effects, real.effects, strict=True):
            assert (ours.name, ours.where) == (theirs.name, theirs.where)
            for key, size in ours.parameters.items():
                assert size.value == pytest.approx(theirs.parameters[key].value, 0.02)


@pytest.mark.parametrize("file", HANDS, ids=lambda file: file.stem)
def test_hands_say_what_made_them(file):
    """Above what was written then, of which nothing was changed by hand."""
    lines = file.read_text("utf-8").splitlines(keepends=True)
    head = "".join(line for line in lines if line.startswith("#"))
    assert re.search(r"at commit [0-9a-f]{7}\b", head)
    assert MADE[file.stem] in head
    assert "".join(lines) == head + hand_yaml(load_hand_file(file))


@pytest.mark.parametrize("file", HANDS, ids=lambda file: file.stem)
def test_hands_are_the_default_one_with_one_effect(file):
    hand, default = load_hand_file(file), load_hand_file()
    assert len(hand.effects) == 1
    assert hand.without_effects == default
    assert hand != default


def test_the_rule_of_the_gain_is_in_its_command():
    """What the specification fixes is what the command asks for, or its default."""
    readme = (CLAIMS / "README.md").read_text("utf-8")
    command = re.search(r"^fingers sysid (transfer .*\n.*)\)$", readme, re.MULTILINE)
    assert command
    words = command[1].replace("\\\n", "").partition("$(")[0].split()
    args = make_parser().parse_args(["sysid", *words, "--policies", "a", "b"])
    assert CLAIMS.parents[1] / args.real == CLAIMS / "hands/deadband_real.yaml"
    seeds = [int(word) for word in re.findall(r"\b\d\b", command[1].split("$(")[1])]
    assert seeds == list(range(MEMBERS["diagnosis_gain"][1]))
    rule = (CLAIMS / "diagnosis_gain.yaml").read_text("utf-8").replace("\n# ", " ")
    assert f"{args.episodes} episodes of each kind and of {args.steps} control" in rule


def test_only_rewards_differ():
    for name in ("tuned_stock", "weights"):
        extra = {"env.rewards": "stock"} if name == "tuned_stock" else {}
        assert dict(swept(name).set) == dict(swept("ablation").set) | extra
        assert swept(name).evaluate == swept("ablation").evaluate
    for name in ("ablation", "weights"):
        for changes in swept(name).configurations.values():
            assert all(
                key.startswith(("env.weights.", "env.rewards")) for key in changes
            )
