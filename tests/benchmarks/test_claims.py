"""The sweeps that test the paper's claims can begin, and differ in rewards alone."""

from pathlib import Path

import pytest

from envs.config.typed import load_yaml
from envs.hand.hand_file import load_hand_file
from fingers_mjx.studies.sweep.resolve import keep_sweep
from fingers_mjx.studies.sweep.spec import Sweep

CLAIMS = Path(__file__).resolve().parents[2] / "benchmarks/claims"
MEMBERS = {
    "ablation": (6, 12),
    "tuned_stock": (24, 2),
    "weights": (8, 6),
    "steering": (4, 2),
    "steering_walker": (2, 2),
    "push_effort": (2, 1),
    "keyboard_creep": (6, 1),
    "diagnosis_gain": (3, 8),
}


def swept(name):
    return load_yaml(Sweep, CLAIMS / f"{name}.yaml")


@pytest.mark.usefixtures("every_backend")
@pytest.mark.parametrize("name", MEMBERS)
def test_the_sweeps_can_begin(tmp_path, name):
    made = keep_sweep(swept(name), CLAIMS / f"{name}.yaml", tmp_path)
    configurations, seeds = MEMBERS[name]
    assert (len(made.configurations), len(made.seeds)) == (configurations, seeds)


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
