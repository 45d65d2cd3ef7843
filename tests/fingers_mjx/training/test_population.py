"""Many learners in one program: each is what it would be alone, whatever the others do.

Bit equality on the CPU: of every leaf of the last checkpoint and of the curve.
"""

import dataclasses

import pytest
from support import train_setup
from support.probe_envs import Fault, probe
from support.train_setup import assert_same_end, curve, leaves, overflowing, setup

from envs.errors import InputError
from envs.task import HandSettings
from fingers_mjx.runs.directory import END_FILE
from fingers_mjx.runs.metrics import read_metrics
from fingers_mjx.training.errors import Diverged, Interrupted
from fingers_mjx.training.population import Member, check_population
from fingers_mjx.training.train import FRESH, Start, train, train_population

WORLDS = 16
OWN = (
    {"seed": 3, "ppo": {"entropy_cost": 0.02, "init_noise_std": 0.3}},
    {"seed": 4, "ppo": {"clip": 0.1, "learning_rate": 3e-4, "desired_kl": 0.03}},
    {"seed": 3},
)
"""What the members have for themselves."""
METRICS = ("episode/return", "kl", "learning_rate", "policy/std", "loss/value")


def members(path, resume=False, **changes):
    ppo = changes.pop("ppo", {})
    configs = [
        train_setup.config(**changes, **own | {"ppo": ppo | own.get("ppo", {})})
        for own in OWN
    ]
    return [
        Member(setup(config), path / f"{index:02d}", Start(resume))
        for index, config in enumerate(configs)
    ]


NOWHERE = Fault(world=-1)


def env(number=3, fault=NOWHERE):
    return probe("seen_action", WORLDS * number, length=3, fault=fault)


def without_weights(monkeypatch):
    """Probes have no reward table whose weights members could have for themselves."""
    monkeypatch.setattr(
        "fingers_mjx.training.session.Session._with_own_weights", lambda self, w: w
    )


@pytest.fixture(autouse=True)
def probes(monkeypatch):
    without_weights(monkeypatch)


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    """Each member as a run of its own."""
    path = tmp_path_factory.mktemp("alone")
    for member in members(path):
        train(env(1), member.setup, member.run_dir)
    return path


@pytest.fixture(scope="module")
def together(tmp_path_factory):
    path, events = tmp_path_factory.mktemp("together"), []
    with pytest.MonkeyPatch.context() as patch:
        without_weights(patch)
        results = train_population(env(), members(path), on_progress=events.append)
    return path, results, events


def test_member_is_what_it_is_alone(alone, together):
    path, results, _ = together
    for index, result in enumerate(results):
        name = f"{index:02d}"
        assert result.iterations == 10
        assert result.diverged is None
        assert_same_end(alone / name, path / name)
        assert curve(alone / name, *METRICS) == curve(path / name, *METRICS)


def test_members_differ(together):
    """Negative control: the third has the first one's seed and other settings."""
    for one, other in ((0, 1), (0, 2)):
        with pytest.raises(AssertionError):
            assert_same_end(together[0] / f"{one:02d}", together[0] / f"{other:02d}")


def test_events_name_the_member(together):
    _, _, events = together
    rows = [event["member"] for event in events if event["event"] == "progress"]
    assert rows == ["00", "01", "02"] * 10
    assert {e["member"] for e in events if e["event"] == "checkpoint"} == set(rows)


def test_members_of_a_sweep_are_named_by_where_they_differ(tmp_path):
    """Their run directories all have the name of the stage."""
    group = [
        dataclasses.replace(m, run_dir=tmp_path / f"plain/{n}/walk")
        for n, m in enumerate(members(tmp_path, iterations=2))
    ]
    events = []
    train_population(env(), group, on_progress=events.append)
    rows = [e["member"] for e in events if e["event"] == "progress"]
    assert rows[:3] == ["0/walk", "1/walk", "2/walk"]


def test_member_goes_on_alone(together, tmp_path):
    """A member's directory is a run's: it resumes without the others."""
    path = tmp_path / "pop"
    train_population(env(), members(path, iterations=6))
    for member in members(path, resume=True):
        train(env(1), member.setup, member.run_dir, start=member.start)
    for index in range(3):
        assert_same_end(together[0] / f"{index:02d}", path / f"{index:02d}")


@pytest.mark.parametrize("last", ["00", "02"])
def test_killed_between_two_members_all_go_on_from_what_they_share(
    together, tmp_path, last
):
    """The first may have saved an iteration that the last has not."""

    class Killed(Exception):
        pass

    def kill(event):
        if event["event"] == "checkpoint" and (event["member"], event["iteration"]) == (
            last,
            6,
        ):
            raise Killed

    path = tmp_path / "pop"
    with pytest.raises(Killed):
        train_population(env(), members(path), on_progress=kill)
    events = []
    train_population(env(), members(path, resume=True), on_progress=events.append)
    notes = [event["text"] for event in events if event["event"] == "note"]
    assert notes[0].endswith("00000004" if last == "00" else "00000006")
    for index in range(3):
        name = f"{index:02d}"
        assert_same_end(together[0] / name, path / name)
        assert curve(together[0] / name, *METRICS) == curve(path / name, *METRICS)


def test_signal_saves_all_members(tmp_path, monkeypatch):
    path = tmp_path / "pop"
    monkeypatch.setattr(
        "fingers_mjx.training.signals.StopSignals.requested", property(lambda s: True)
    )
    with pytest.raises(Interrupted):
        train_population(env(), members(path))
    assert [leaves(path / f"{index:02d}")[0] for index in range(3)] == [1, 1, 1]


TOO_LARGE = Fault("reward", 3e38, world=WORLDS + 7, at=9, until=10**9)


def spoiled(path, **changes):
    """A population whose second member meets rewards too large to square."""
    events = []
    results = train_population(
        env(fault=TOO_LARGE),
        members(path, ppo={"max_bad_updates": 1}, **changes),
        on_progress=events.append,
    )
    return results, events


def test_member_that_diverges_is_frozen_and_the_others_are_as_alone(tmp_path):
    path = tmp_path / "pop"
    results, events = spoiled(path)
    assert [result.diverged is None for result in results] == [True, False, True]
    lost = results[1].diverged
    assert isinstance(lost, Diverged)
    assert lost.iteration == 2
    assert lost.dump.is_file()
    assert results[1].iterations == 2
    notes = [event for event in events if event["event"] == "note"]
    assert notes[0]["member"] == "01"
    assert notes[0]["text"].startswith("01: diverged at iteration 2: loss/")
    for index in (0, 2):
        member = members(tmp_path / "alone", ppo={"max_bad_updates": 1})[index]
        nowhere = dataclasses.replace(TOO_LARGE, world=-1)
        train(env(1, nowhere), member.setup, member.run_dir)
        assert_same_end(member.run_dir, path / member.run_dir.name)

    # Gone on with, it stays as it is, and so do the others' results.
    before = read_metrics(path / "01" / "metrics.jsonl")
    again = train_population(
        env(), members(path, resume=True, ppo={"max_bad_updates": 1}, iterations=14)
    )
    assert [r.iterations for r in again] == [14, 2, 14]
    assert str(again[1].diverged) == str(lost)
    assert read_metrics(path / "01" / "metrics.jsonl") == before


def test_population_ends_when_all_have_diverged(tmp_path):
    fault = Fault("reward", 3e38, at=9, until=10**9)
    config = train_setup.config(ppo={"max_bad_updates": 1})
    worlds = probe("seen_action", 2 * WORLDS, length=3, fault=fault)

    class Everywhere:
        """The probe with the fault in all of its worlds."""

        def __getattr__(self, name):
            return getattr(worlds, name)

        def reset(self, key):
            state = worlds.reset(key)
            return state.replace(data=state.data | {"hit": state.data["clock"] == 0})

    both = [
        Member(setup(dataclasses.replace(config, seed=s)), tmp_path / f"{s}")
        for s in (0, 1)
    ]
    results = train_population(Everywhere(), both)
    assert all(result.diverged for result in results)
    assert [result.iterations for result in results] == [2, 2]
    assert (tmp_path / "0" / END_FILE).is_file()


def in_room(path, room, start=FRESH, **changes):
    """Returns two members with some room for contacts."""
    config = train_setup.config(checkpoint_every=1, **changes)
    return [
        Member(
            setup(dataclasses.replace(config, seed=seed), HandSettings(**room)),
            path / str(seed),
            start,
        )
        for seed in (0, 1)
    ]


def test_dropped_contacts_end_the_program_and_with_more_room_all_go_on(tmp_path):
    """One member's world has too many; the room for them is that of all."""
    worlds, resume = 2 * WORLDS, Start(resume=True)
    with pytest.raises(InputError, match="dropped in 1 of 16 worlds") as error:
        train_population(
            overflowing(48, worlds), in_room(tmp_path, {"contacts_per_world": 48})
        )
    assert error.value.field == "env.contacts_per_world"
    assert [leaves(tmp_path / name)[0] for name in "01"] == [1, 1]
    wider = {"contacts_per_world": 192}
    other = in_room(tmp_path, wider | {"action_clip": 1.0}, resume)
    with pytest.raises(InputError, match=r"env\.action_clip: found 1\.0"):
        train_population(overflowing(192, worlds), other)
    members = in_room(tmp_path, wider, resume, on_overflow="warn", log_every=5)
    results = train_population(overflowing(192, worlds), members)
    assert [result.iterations for result in results] == [10, 10]


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"num_envs": 32}, "train.num_envs"),
        ({"iterations": 5}, "train.iterations"),
        ({"ppo": {"actor_layers": (4,)}}, "train.ppo.actor_layers"),
        ({"ppo": {"epochs": 1}}, "train.ppo.epochs"),
    ],
)
def test_what_is_compiled_in_must_be_shared(tmp_path, change, field):
    first, *_ = members(tmp_path)
    other = Member(setup(train_setup.config(**change)), tmp_path / "other")
    with pytest.raises(InputError) as error:
        check_population([first, other])
    assert error.value.field == field
    assert "as the other members have" in str(error.value)


def test_two_members_in_one_directory_are_refused(tmp_path):
    first, *_ = members(tmp_path)
    with pytest.raises(InputError, match="one directory a member"):
        check_population([first, first])
    with pytest.raises(InputError, match="members"):
        check_population([])


def test_members_that_resume_and_new_ones_are_not_mixed(tmp_path):
    first, second, *_ = members(tmp_path)
    gone_on = Member(second.setup, second.run_dir, Start(resume=True))
    with pytest.raises(InputError, match="one or the other"):
        check_population([first, gone_on])
