"""From what the user writes to what the directory keeps."""

import dataclasses
import json
import shutil
from pathlib import Path

import pytest
from support.sweep_setup import TINY, sweep

import fingers_mjx
from envs.config.typed import load_yaml
from envs.errors import InputError
from envs.hand.hand_file import DEFAULT_HAND_FILE, load_hand_file
from fingers_deploy import load_bundle
from fingers_mjx.policy.place import is_bundle
from fingers_mjx.studies.sweep import resolve
from fingers_mjx.studies.sweep.plan import Key, keys, trainings
from fingers_mjx.studies.sweep.resolve import (
    SPEC_FILE,
    check_only_added,
    keep_sweep,
    machine_backend,
    resolved,
    saved_sweep,
)
from fingers_mjx.studies.sweep.spec import Sweep

CRAWL = Path(fingers_mjx.__file__).parent / "policies" / "crawl"
SEARCH = {"samples": 3, "space": {"ppo.clip": {"low": 0.1, "high": 0.3}}}


@pytest.fixture
def source(tmp_path):
    return tmp_path / "written.yaml"


def kept(root, source, **changes):
    root.mkdir(exist_ok=True)
    return keep_sweep(sweep(**changes), source, root)


def test_what_is_kept_reads_back_and_resolves_to_itself(tmp_path, source):
    root = tmp_path / "sweep"
    spec = kept(root, source, search=SEARCH, configurations={"plain": {}})
    assert list(spec.configurations) == ["plain", *(f"sample-0{n}" for n in range(3))]
    assert saved_sweep(root) == spec
    again = load_yaml(Sweep, root / SPEC_FILE)
    assert keep_sweep(again, root / SPEC_FILE, root) == spec


def test_defaults_go_by_the_backend(source):
    spec = sweep(preset=None, backend=None, engine=None, configurations={})
    ray, _ = resolved(dataclasses.replace(spec, engine="ray"), source, "warp")
    assert (ray.preset, ray.engine, ray.threads) == ("fast", "ray", None)
    cpu, _ = resolved(spec, source, "cpu")
    gpu, _ = resolved(spec, source, "warp")
    assert (cpu.preset, cpu.engine, cpu.threads) == ("cpu", "local", 1)
    assert (gpu.preset, gpu.engine, gpu.threads) == ("fast", "population", None)
    assert cpu.configurations == {"base": {}}
    assert gpu.evaluate.backend == "warp"


def test_hands_are_kept_beside_the_sweep(tmp_path, source):
    shutil.copy(DEFAULT_HAND_FILE, tmp_path / "mine.yaml")
    root = tmp_path / "sweep"
    configurations = {"paper": {}, "mine": {"hand": "mine.yaml"}}
    spec = kept(root, source, configurations=configurations)
    (tmp_path / "mine.yaml").unlink()
    (training,) = trainings(spec, root, Key("mine", 0))
    assert training.setup.hand == load_hand_file(DEFAULT_HAND_FILE)
    assert keep_sweep(spec, root / SPEC_FILE, root) == spec


def test_the_policy_that_members_start_from_is_kept(tmp_path, source):
    shutil.copytree(CRAWL, tmp_path / "walker")
    root = tmp_path / "sweep"
    spec = kept(root, source, warm_start="walker")
    shutil.rmtree(tmp_path / "walker")
    assert spec.warm_start is not None
    assert is_bundle(root / spec.warm_start)
    assert load_bundle(root / spec.warm_start).model == load_bundle(CRAWL).model
    assert keep_sweep(spec, root / SPEC_FILE, root) == spec


def test_a_policy_that_is_missing_is_named(tmp_path, source):
    with pytest.raises(InputError, match="walker: found No such file"):
        kept(tmp_path / "sweep", source, warm_start="walker")


def test_seeds_and_configurations_are_added(tmp_path, source):
    root = tmp_path / "sweep"
    before = kept(root, source, seeds=2, configurations={"plain": {}})
    more = {"plain": {}, "clip": {"ppo.clip": 0.1}}
    after = kept(root, source, seeds=3, configurations=more, processes=7)
    assert set(keys(after)) > set(keys(before))


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"seeds": 1}, "seeds.1"),
        ({"seeds": [0, 2]}, "seeds.1"),
        ({"task": "recovery"}, "task"),
        ({"threads": 2}, "threads"),
        ({"configurations": {"plain": {}}}, "configurations.lift"),
        (
            {"configurations": {"plain": {"ppo.clip": 0.1}, "lift": {}}},
            "configurations.plain",
        ),
        ({"evaluate": {"episodes": 5}}, "evaluate.episodes"),
        ({"stages": [{"name": "walk"}]}, "stages"),
    ],
)
def test_anything_else_that_changes_is_refused_by_name(source, change, field):
    before, _ = resolved(sweep(), source, "cpu")
    after, _ = resolved(sweep(**change), source, "cpu")
    check_only_added(before, before, source)
    with pytest.raises(InputError, match="as the sweep was begun") as error:
        check_only_added(before, after, source)
    assert error.value.field == field


BEGUN = {
    "set": TINY | {"env.contacts_per_world": 48, "log_every": 1},
    "stages": [{"name": "walk", "set": {"hang_limit_s": 60.0}}],
    "configurations": {"plain": {"keep_checkpoints": 2}, "lift": {}},
}
FREED = [
    {"set": TINY | {"env.contacts_per_world": 96, "log_every": 3}},
    {"set": TINY | {"env.constraints_per_world": 256, "on_overflow": "warn"}},
    {"set": TINY},
    {"stages": [{"name": "walk", "set": {"on_overflow": "warn"}}]},
    {"stages": [{"name": "walk"}]},
    {"configurations": {"plain": {"env.contacts_per_world": 96}, "lift": {}}},
]
BOUND = [
    ({"set": TINY | {"iterations": 6}}, "set.iterations"),
    ({"set": TINY | {"env.contacts_per_world": 96, "ppo.clip": 0.1}}, "set.ppo.clip"),
    ({"set": TINY | {"env.action_clip": 1.0}}, "set.env.action_clip"),
    ({"stages": [{"name": "walk", "set": {"iterations": 6}}]}, "stages"),
    ({"stages": [{"name": "walk", "set": {"ppo.clip": 0.1}}]}, "stages"),
    (
        {"configurations": {"plain": {"iterations": 6}, "lift": {}}},
        "configurations.plain",
    ),
    (
        {"configurations": {"plain": {"log_every": 3, "num_envs": 4}, "lift": {}}},
        "configurations.plain",
    ),
]


@pytest.mark.parametrize("change", FREED, ids=str)
def test_what_a_resumed_run_may_change_a_sweep_may(tmp_path, source, change):
    """Changed, added or gone: what Warp had too little room for can be given more."""
    root = tmp_path / "sweep"
    before = kept(root, source, **BEGUN)
    after = kept(root, source, **BEGUN | change)
    assert after != before and saved_sweep(root) == after
    assert keys(after) == keys(before)


@pytest.mark.parametrize(("change", "field"), BOUND, ids=str)
def test_what_changes_a_member_a_sweep_may_not(tmp_path, source, change, field):
    """Negative control; the number of iterations is what members are trained for."""
    before = kept(tmp_path / "sweep", source, **BEGUN)
    with pytest.raises(InputError, match="as the sweep was begun") as error:
        kept(tmp_path / "sweep", source, **BEGUN | change)
    assert error.value.field == field
    assert saved_sweep(tmp_path / "sweep") == before


def test_a_machine_is_asked_only_where_no_backend_is_named(tmp_path, source):
    asked = []
    ask = lambda: asked.append("cpu") or "cpu"  # noqa: E731
    (tmp_path / "sweep").mkdir()
    for spec in (sweep(), sweep(backend=None), sweep(backend=None)):
        assert keep_sweep(spec, source, tmp_path / "sweep", ask).backend == "cpu"
    assert asked == []  # the sweep was begun with one
    (tmp_path / "other").mkdir()
    keep_sweep(sweep(backend=None), source, tmp_path / "other", ask)
    assert asked == ["cpu"]


@pytest.mark.parametrize("said", [[], ["no driver"]])
def test_what_jax_says_of_cuda_comes_back_with_the_backend(monkeypatch, said):
    program = f"print('Warp 1.0'); print({json.dumps(json.dumps(['cpu', said]))})"
    monkeypatch.setattr(resolve, "_ASK", program)
    faults = []
    assert (machine_backend(faults.append), faults) == ("cpu", said)


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"set": {"ppo.klip": 0.1}}, "set.ppo.klip"),
        ({"stages": [{"set": {"num_env": 4}}]}, "stages.train.set.num_env"),
        (
            {"configurations": {"lift": {"env.weights.lif": 1.0}}},
            "configurations.lift.env.weights.lif",
        ),
        ({"evaluate": {"set": {"env.episode": 1}}}, "evaluate.set.env.episode"),
        ({"set": {"num_envs": 7}}, "set.num_envs"),
    ],
)
def test_a_setting_that_does_not_fit_names_its_place(tmp_path, source, change, field):
    with pytest.raises(InputError) as error:
        kept(tmp_path / "sweep", source, **change)
    assert (error.value.source, error.value.field) == (source, field)
    assert not (tmp_path / "sweep" / SPEC_FILE).exists()


def test_a_configuration_counts_before_its_stage_and_that_before_all(tmp_path, source):
    stages = [{"name": "walk", "set": {"ppo.clip": 0.2, "ppo.epochs": 2}}]
    configurations = {"one": {"ppo.clip": 0.3}}
    made = {"stages": stages, "configurations": configurations}
    spec = kept(tmp_path / "sweep", source, **made)
    (training,) = trainings(spec, tmp_path / "sweep", Key("one", 5))
    train = training.setup.train
    assert (train.ppo.clip, train.ppo.epochs, train.num_envs) == (0.3, 2, 8)
    assert (train.seed, train.backend) == (5, "cpu")


def test_a_sweep_does_not_begin_among_other_files(tmp_path, source):
    (tmp_path / "sweep").mkdir()
    (tmp_path / "sweep" / "thesis.tex").touch()
    with pytest.raises(InputError, match="thesis"):
        kept(tmp_path / "sweep", source)


def test_names_of_search_and_configurations_do_not_collide(source):
    spec = dataclasses.replace(sweep(search=SEARCH), configurations={"sample-00": {}})
    with pytest.raises(InputError, match="sample-00"):
        resolved(spec, source, "cpu")
