"""The engine `population`: who shares a program, and how many."""

import dataclasses
from types import SimpleNamespace

import pytest
from support.sweep_setup import (
    TINY,
    plan_faults,
    pretend_warp,
    run_fake,
    states,
    sweep,
)
from support.sweep_worker import finish

from envs.errors import InputError
from fingers_mjx.runs.directory import END_FILE
from fingers_mjx.studies.sweep import worker
from fingers_mjx.studies.sweep.engines import population as engine
from fingers_mjx.studies.sweep.engines.population import machine_worlds, population
from fingers_mjx.studies.sweep.plan import Key, keys, trainings
from fingers_mjx.studies.sweep.resolve import keep_sweep

CONFIGURATIONS = {
    "plain": {},
    "costly": {"ppo.entropy_cost": 0.1, "env.curriculum_scale": 0.5},
    "heavy": {"env.weights.lift": 5.0},
    "wide": {"ppo.actor_layers": [16]},
    "long": {"env.episode_s": 2.0},
}


def chosen(root, failures=lambda key: 0, **changes):
    """Returns the groups of all members, in turn."""
    base = {"configurations": CONFIGURATIONS, "engine": "population", "processes": 1}
    changes = base | changes
    root.mkdir(exist_ok=True)
    spec = keep_sweep(sweep(**changes), root / "spec.yaml", root)
    made, waiting, groups = population(spec, root), keys(spec), []
    while waiting:
        groups.append(made.choose(waiting, failures))
        waiting = [key for key in waiting if key not in groups[-1]]
    return groups


def names(group):
    return sorted({key.configuration for key in group})


def test_a_program_has_members_that_differ_in_numbers_alone(tmp_path):
    groups = chosen(tmp_path)
    assert [names(group) for group in groups] == [
        ["costly", "heavy", "plain"],
        ["wide"],
        ["long"],
    ]
    assert [len(group) for group in groups] == [6, 2, 2]


def test_a_program_has_as_many_worlds_as_fit(tmp_path):
    groups = chosen(tmp_path, configurations={"plain": {}}, seeds=5, worlds_at_once=16)
    assert [len(group) for group in groups] == [2, 2, 1]
    alone = chosen(tmp_path, configurations={"plain": {}}, seeds=5, worlds_at_once=1)
    assert [len(group) for group in alone] == [1] * 5


def test_members_that_failed_come_in_smaller_programs(tmp_path):
    failed = {Key("plain", seed): 1 for seed in range(4)}
    groups = chosen(
        tmp_path,
        lambda key: failed.get(key, 0),
        configurations={"plain": {}},
        seeds=8,
        worlds_at_once=32,
    )
    assert [len(group) for group in groups] == [2, 2, 4]


def test_members_that_have_come_equally_far_go_on_together(tmp_path):
    changes = {"configurations": {"plain": {}}, "seeds": 4, "engine": "population"}
    spec = keep_sweep(sweep(**changes), tmp_path / "spec.yaml", tmp_path)
    for seed, saved in ((0, "00000002"), (2, "00000002"), (3, "00000001")):
        place = Key("plain", seed).directory(tmp_path) / "train/checkpoints"
        (place / saved).mkdir(parents=True)
    made = population(spec, tmp_path)
    assert [key.seed for key in made.choose(keys(spec), lambda key: 0)] == [0, 2]


def test_faults_in_one_program_are_each_members_own(tmp_path):
    """A worker of several members: who diverged, who is done, and one log."""
    plan_faults(tmp_path, {"lift/0": ["nan"], "plain/1": ["killed"]})
    manifest = run_fake(tmp_path, population, engine="population", processes=1)
    assert states(manifest) == {
        "plain/0": "done",
        "lift/0": "diverged",
        "plain/1": "done",
        "lift/1": "done",
    }
    log = (tmp_path / "runs/lift/1/log.txt").read_text("utf-8")
    assert log.splitlines()[0] == "in one program with plain/0, whose log has the lines"


@pytest.mark.parametrize(("backend", "together"), [("warp", [0, 1]), ("cpu", [0])])
def test_members_that_diverged_on_warp_begin_again_together(
    tmp_path, monkeypatch, backend, together
):
    """Wherever they were; negative control: on the CPU they would go on from there."""
    pretend_warp(monkeypatch)
    changes = {"configurations": {"plain": {}}, "seeds": 6, "backend": backend}
    spec = keep_sweep(sweep(**changes, processes=1), tmp_path / "spec.yaml", tmp_path)
    for seed, saved in ((0, "00000002"), (1, "00000001")):
        run = Key("plain", seed).directory(tmp_path) / "train"
        (run / "checkpoints" / saved).mkdir(parents=True)
        (run / END_FILE).touch()
    made = population(spec, tmp_path)
    found = made.choose(keys(spec), lambda key: int(key.seed < 2))
    assert [key.seed for key in found] == together


ROOM = "env.contacts_per_world"


def train_in_room(spec, root, keys, on_progress):
    """Pretends to train as one program on Warp: seed 1 has many contacts."""
    room = trainings(spec, root, keys[0])[0].setup.env.contacts_per_world
    if room < 96 and any(key.seed == 1 for key in keys):
        what = "iteration 2: contacts dropped in 1 of 32 worlds"
        raise InputError(what, ROOM, room, f"about {2 * room}")
    return {}


def evaluated(spec, root, keys):
    for key in keys:
        run = trainings(spec, root, key)[-1].path
        (run / "eval").mkdir(parents=True, exist_ok=True)
        finish(run, *key)
    return {}


def in_this_process(spec, root, command):
    """The engine `population` with workers that are done when they are started."""

    def launch(keys):
        words = [str(root), *(word for key in keys for word in map(str, key))]
        status = worker.main(words, train_in_room, evaluated)
        return SimpleNamespace(poll=lambda: status, stop=lambda: None)

    return dataclasses.replace(population(spec, root, command), launch=launch)


def test_all_of_a_program_without_room_fail_and_go_on_with_more(tmp_path):
    """All say which setting; with it changed the same sweep is finished."""
    how = {"engine": "population", "processes": 1}
    manifest = run_fake(tmp_path, in_this_process, **how)
    assert set(states(manifest).values()) == {"failed"} and len(manifest.members) == 4
    assert all(f"{ROOM}: found 48" in m.reason for m in manifest.members)
    assert [m.attempts for m in manifest.members] == [1] * 4
    manifest = run_fake(tmp_path, in_this_process, **how, set=TINY | {ROOM: 96})
    assert set(states(manifest).values()) == {"done"}
    assert [m.attempts for m in manifest.members] == [2] * 4


def test_the_memory_of_a_gpu_bounds_its_worlds(monkeypatch):
    assert machine_worlds("cpu") == engine.WORLDS_ON_CPU

    monkeypatch.setattr(engine, "gpu_facts", lambda field: ["143771", "143771"])
    assert 8 * 4096 <= machine_worlds("warp") < 10 * 4096
    monkeypatch.setattr(engine, "gpu_facts", lambda field: [])
    assert machine_worlds("warp") == engine.WORLDS_ON_CPU


def test_several_programs_have_equal_parts(tmp_path):
    root = tmp_path / "sweep"
    made = chosen(root, configurations={"plain": {}}, seeds=12, processes=4)
    assert [len(group) for group in made] == [3, 3, 3, 3]
