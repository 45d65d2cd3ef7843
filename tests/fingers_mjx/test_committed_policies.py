"""Every committed policy fits its task as it is now and comes with its measurement."""

import json
from pathlib import Path

import pytest

import fingers_mjx
from envs.registry import task_names
from fingers_deploy import load_bundle, load_policy
from fingers_deploy.bundle import check_parity
from fingers_mjx.policy.interface import check_interface, interface_of
from fingers_mjx.policy.source import load_source
from fingers_mjx.runs.setup import make_env

POLICIES = Path(fingers_mjx.__file__).parent / "policies"
FOLDERS = sorted(path for path in POLICIES.iterdir() if path.is_dir())
STATED = {
    "crawl": POLICIES.parents[1] / "README.md",
    "crawl_steering": POLICIES / "crawl_steering" / "README.md",
    "keyboard": POLICIES / "keyboard" / "README.md",
    "push": POLICIES / "push" / "README.md",
    "recovery": POLICIES / "recovery" / "README.md",
}
WALK = ("task_speed_mps", "path_speed_mps", "turn_rate_error_rad_s")
MEASURES = {
    "crawl": (*WALK, "planar_velocity_error_mps"),
    "crawl_steering": (*WALK, "planar_velocity_error_mps"),
    "keyboard": ("correct_fraction", "latency_median_s"),
    "push": ("delivered", "delivered_from_30_cm"),
    "recovery": ("righted", "righted_thumb", "time_to_upright_s"),
}

each = pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: folder.name)


def task_of(folder):
    """Returns its first word; others say how a policy differs from that of its task."""
    return folder.name.split("_")[0]


def test_each_is_named_after_its_task():
    assert {task_of(folder) for folder in FOLDERS} <= set(task_names())


@each
def test_its_network_computes_what_it_did_when_it_was_exported(folder):
    bundle = load_bundle(folder)
    check_parity(bundle, load_policy(bundle, "onnxruntime"))


@each
def test_its_interface_is_that_of_the_task_today(folder):
    source = load_source(folder)
    env = make_env(source.setup, 1, "cpu")
    found = load_bundle(folder).manifest.interface
    check_interface(folder, found, interface_of(env))


@each
def test_the_text_states_what_was_measured(folder):
    measured = json.loads((folder / "evaluation.json").read_text("utf-8"))
    assert measured["task"] == task_of(folder)
    text = STATED[folder.name].read_text("utf-8")
    for name in MEASURES[folder.name]:
        value = measured["measures"][name]
        spellings = [
            f"{value['mean']:.{digits}f} ({value['low']:.{digits}f}–"
            for digits in (2, 3)
        ]
        assert any(stated in text for stated in spellings), (name, spellings)
