"""The driver: the same curve whatever happens on the way, and honest ends.

T3 (resumed = straight), T4 (changed settings refused), T5 (damage passed over), T6
(full disk), T8 (faults named, set aside, or ending the run), T10 (nothing compiled,
nothing grows), T12 (same seed, same run).
"""

import dataclasses
import resource
from pathlib import Path

import jax
import numpy as np
import pytest
from support import train_setup
from support.checkpoint_child import watched_steps
from support.probe_envs import Fault, probe
from support.train_setup import (
    assert_same_end,
    curve,
    leaves,
    make_env,
    overflowing,
    run,
    setup,
)

from envs.errors import InputError
from envs.task import HandSettings
from fingers_mjx.policy.actor import act, load_policy
from fingers_mjx.runs import checkpoint
from fingers_mjx.runs.files import OutOfSpace
from fingers_mjx.runs.tree import to_host
from fingers_mjx.training.errors import Diverged
from fingers_mjx.training.session import Session
from fingers_mjx.training.train import Start, train
from fingers_mjx.training.warm_start import started_from

RESUME = Start(resume=True)


@pytest.fixture(scope="module")
def straight(tmp_path_factory):
    """Ten iterations without interruption."""
    path = tmp_path_factory.mktemp("straight") / "run"
    events = []
    result = run(path, on_progress=events.append)
    return path, result, events


def test_run_leaves_everything(straight):
    path, result, events = straight
    assert result.iterations == 10
    assert result.checkpoint.name == "00000010"
    assert result.metrics["env_steps"] == 10 * 16 * 4
    assert [p.name for p in checkpoint.checkpoints(path / "checkpoints")] == [
        "00000006",
        "00000008",
        "00000010",
    ]
    kinds = [e["event"] for e in events]
    assert kinds[0] == "compiling"
    assert kinds.count("progress") == 10
    assert kinds.count("checkpoint") == 5
    assert kinds.index("progress") > max(
        i for i, k in enumerate(kinds) if k == "compiling"
    )
    named = {"reward/probe", "kl", "learning_rate", "policy/entropy", "invalid"}
    assert named <= result.metrics.keys()
    assert {p.stat().st_mode & 0o777 for p in path.rglob("*") if p.is_file()} == {0o644}


def test_resumed_run_is_bit_equal_to_a_straight_one(straight, tmp_path):
    """Five iterations, then new objects and five more: every leaf and metric."""
    path = tmp_path / "run"
    run(path, iterations=5)
    stopped = leaves(path)[1]
    run(path, resume=True)
    assert_same_end(straight[0], path)
    metrics = ("env_steps", "episode/return", "kl", "learning_rate")
    assert curve(path, *metrics) == curve(straight[0], *metrics)
    assert any(stopped[k].tobytes() != v.tobytes() for k, v in leaves(path)[1].items())


def test_same_seed_gives_the_same_run(straight, tmp_path):
    run(tmp_path / "run")
    assert_same_end(straight[0], tmp_path / "run")


def test_another_seed_ends_elsewhere(straight, tmp_path):
    """Negative control of bit-equality."""
    run(tmp_path / "run", seed=1)
    with pytest.raises(AssertionError):
        assert_same_end(straight[0], tmp_path / "run")


def test_finished_run_is_left_as_it_is(straight):
    path, result, _ = straight
    before = {p: p.stat().st_mtime_ns for p in (path / "checkpoints").rglob("*")}
    again = run(path, resume=True)
    assert again.checkpoint == result.checkpoint
    assert before == {p: p.stat().st_mtime_ns for p in before}


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"num_envs": 32}, "train.num_envs"),
        ({"seed": 5}, "train.seed"),
        ({"task": "keys"}, "train.task"),
        ({"backend": "warp"}, "train.backend"),
        ({"iterations_per_call": 5}, "train.iterations_per_call"),
        ({"ppo": {"clip": 0.3}}, "train.ppo.clip"),
        ({"ppo": {"actor_layers": (8, 8)}}, "train.ppo.actor_layers"),
    ],
)
def test_resume_with_other_settings_is_refused(straight, change, field):
    with pytest.raises(InputError) as error:
        run(
            straight[0], resume=True, **{"log_every": 5, "checkpoint_every": 5} | change
        )
    assert error.value.field == field
    assert "as saved" in str(error.value)


@pytest.mark.parametrize(
    ("more", "field"),
    [
        ({"identity": {"model_sha256": "ab"}}, "identity.model_sha256"),
        ({"identity": {"joint_names": ["b", "a"]}}, "identity.joint_names"),
        ({"env": {"speed": 1.0}}, "env.speed"),
    ],
)
def test_resume_with_another_model_is_refused(straight, more, field):
    settings, identity = setup(env=more.get("env")), more.get("identity")
    with pytest.raises(InputError) as error:
        train(make_env(), settings, straight[0], start=RESUME, identity=identity)
    assert error.value.field in (field, "env")


def test_resume_with_another_jax_is_refused(straight, monkeypatch):
    monkeypatch.setattr(jax, "__version__", "0.7.0")
    with pytest.raises(InputError) as error:
        run(straight[0], resume=True)
    assert error.value.field == "jax"


def test_warm_start_takes_networks_and_normalizer_but_not_the_noise(straight):
    session = Session(make_env(16), [setup()])
    fresh = session.split(session.start())[0].train
    old = checkpoint.load(straight[1].checkpoint).into(session.template).train
    warm = to_host(started_from(fresh, session.env, straight[0]))
    assert any("std_" in name for name in warm)
    for name, value in warm.items():
        taken = name.startswith(("params/", "normalizer/")) and "std_" not in name
        source = to_host(old if taken else fresh)
        assert value.tobytes() == source[name].tobytes(), name


def test_warm_started_run_begins_anew(straight, tmp_path):
    path = tmp_path / "run"
    settings = setup(train_setup.config(iterations=2))
    train(make_env(), settings, path, start=Start(warm_start=straight[0]))
    arrays, before = leaves(path)[1], leaves(straight[0])[1]
    assert arrays["train/iteration"] == 2
    assert arrays["train/optimizer/1/count"] == 8
    count = "train/normalizer/count/lo"
    assert arrays[count] == before[count] + 2 * 64


def test_warm_start_from_other_networks_is_refused(straight, tmp_path):
    settings = setup(train_setup.config(ppo={"critic_layers": (4,)}))
    with pytest.raises(InputError) as error:
        train(
            make_env(),
            settings,
            tmp_path / "run",
            start=Start(warm_start=straight[0]),
        )
    assert not (tmp_path / "run").exists()
    assert error.value.field == "train/params/value/params/hidden_0/bias"
    with pytest.raises(InputError, match="--warm-start"):
        Start(resume=True, warm_start=straight[0])


def test_policy_read_back_acts_like_the_network(straight):
    policy = load_policy(straight[0])
    session = Session(make_env(16), [setup()])
    state = checkpoint.load(straight[1].checkpoint).into(session.template)
    obs = np.linspace(-2, 2, 9, dtype=np.float32)[:, None]
    train_state = state.train
    mean, std = session.learner.networks.policy_network.apply(
        train_state.normalizer, train_state.params.policy, {"state": obs}
    )
    np.testing.assert_allclose(act(policy, obs), mean, atol=1e-5)
    np.testing.assert_allclose(policy.noise_std, std[0], rtol=1e-6)
    assert policy.meta["env_steps"] == 640


def test_damaged_checkpoint_is_passed_over_and_reported(straight, tmp_path):
    path = tmp_path / "run"
    run(path, iterations=6)
    (path / "checkpoints" / "00000006" / "meta.json").unlink()
    events = []
    run(path, resume=True, on_progress=events.append)
    notes = [e["text"] for e in events if e["event"] == "note"]
    assert "00000006 is damaged" in notes[0]
    assert "going on from" in notes[1]
    assert_same_end(straight[0], path)


def test_full_disk_stops_and_keeps_what_was_saved(tmp_path, monkeypatch):
    path, real = tmp_path / "run", checkpoint.save

    def save(directory, iteration, *args):
        def fill(point):
            if iteration == 6 and point == "sealed":
                raise OSError(28, "No space left on device")

        with watched_steps(fill):
            return real(directory, iteration, *args)

    monkeypatch.setattr(checkpoint, "save", save)
    with pytest.raises(OutOfSpace, match="00000006"):
        run(path)
    assert leaves(path)[0] == 4
    monkeypatch.undo()
    assert run(path, resume=True).iterations == 10


def test_full_disk_of_the_curve_stops_within_one_row(tmp_path):
    """A limit of file size, which the learning curve is the first to reach."""
    path, limits = tmp_path / "run", resource.getrlimit(resource.RLIMIT_FSIZE)

    def fill(event):
        if event["event"] == "checkpoint" and event["iteration"] == 4:
            room = (path / "metrics.jsonl").stat().st_size + 100
            resource.setrlimit(resource.RLIMIT_FSIZE, (room, limits[1]))

    try:
        with pytest.raises(
            OutOfSpace, match=r"metrics\.jsonl: needs \d+ bytes"
        ) as full:
            run(path, on_progress=fill, checkpoint_every=4)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert full.value.exit_code == 4
    assert leaves(path)[0] == 4
    assert run(path, resume=True, checkpoint_every=4).iterations == 10
    assert [row[0] for row in curve(path)] == list(range(1, 11))


def test_dropped_contacts_stop_the_run(tmp_path):
    """T9: with world count and a value, within an iteration; what was saved stays."""
    config = train_setup.config(log_every=10, checkpoint_every=1)
    path, room = tmp_path / "run", HandSettings(contacts_per_world=48)
    with pytest.raises(InputError) as error:
        train(overflowing(), setup(config, room), path)
    begins = "iteration 2: contacts dropped in 1 of 16 worlds: env.contacts_per_world: "
    assert str(error.value).startswith(begins + "found 48; valid: about 96, or on_over")
    assert leaves(path)[0] == 1

    # Only the room may be changed on the way; nothing else of the task.
    wider = dataclasses.replace(room, contacts_per_world=192)
    other = dataclasses.replace(wider, action_clip=1.0)
    with pytest.raises(InputError, match=r"env\.action_clip: found 1\.0"):
        train(overflowing(), setup(config, other), path, start=RESUME)
    result = train(overflowing(192), setup(config, wider), path, start=RESUME)
    assert result.iterations == 10


def test_a_run_can_be_set_to_go_on_without_dropped_contacts(tmp_path):
    """T9: it says so after the row of the iteration in which it happened."""
    events, config = [], train_setup.config(on_overflow="warn")
    path, room = tmp_path / "run", HandSettings()
    train(overflowing(), setup(config, room), path, on_progress=events.append)
    kinds = [(e["event"], e.get("iteration")) for e in events]
    notes = [i for i, e in enumerate(events) if "contacts dropped" in str(e)]
    assert [kinds[i - 1] for i in notes] == [("progress", 2)]
    assert "in 1 of 16 worlds" in events[notes[0]]["text"]
    hit = [row[1] for row in curve(path, "contact_overflow_worlds")]
    assert hit == [0, 1, *[0] * 8]


def poisoned(fault):
    return probe("seen_action", 16, length=3, fault=fault)


def test_fault_of_a_world_is_reported_with_its_number(tmp_path):
    events = []
    env = poisoned(Fault("reward", np.nan, world=7, at=5))
    result = train(env, setup(), tmp_path / "run", on_progress=events.append)
    notes = [e["text"] for e in events if e["event"] == "note"]
    assert notes == [
        "iteration 1: reward of world 7 is not finite; the step was set aside"
    ]
    assert [x for _, x in curve(tmp_path / "run", "invalid")][:3] == [0.0, 1.0, 0.0]
    assert result.metrics["updates_skipped"] == 0


def test_divergence_names_term_step_and_state(tmp_path):
    """Rewards too large to square: finite themselves, so only the update shows it."""
    env = poisoned(Fault("reward", 3e38, world=7, at=9, until=10**9))
    config = train_setup.config(ppo={"max_bad_updates": 1})
    with pytest.raises(Diverged) as error:
        train(env, setup(config), tmp_path / "run")
    diverged = error.value
    assert diverged.exit_code == 3
    assert diverged.iteration == 2
    assert diverged.term.startswith("loss/")
    assert str(diverged.dump) in str(diverged)
    assert diverged.checkpoint.name == "00000002"
    assert diverged.dump.stat().st_size <= 50 * 2**20
    with np.load(diverged.dump, allow_pickle=False) as dump:
        assert all(np.isfinite(v).all() for k, v in dump.items() if "params" in k)
        assert dump["worlds/index"].size == 16


def test_passing_fault_of_the_update_is_skipped_and_survived(tmp_path):
    env = poisoned(Fault("reward", 3e38, world=7, at=9, until=10))
    result = train(env, setup(), tmp_path / "run")
    assert 0 < result.metrics["updates_skipped"] <= 4
    arrays = leaves(tmp_path / "run")[1]
    learned = [v for k, v in arrays.items() if k.startswith("train/")]
    assert all(np.isfinite(v).all() for v in learned)


@pytest.mark.parametrize(
    ("iterations", "growth"),
    [(230, 1.02), pytest.param(5000, 1.05, marks=pytest.mark.slow)],
)
def test_no_compilation_and_no_growth_after_the_first_rows(
    tmp_path, iterations, growth
):
    compiled, resident = [], []

    def watch(event):
        if event["event"] == "progress":
            pages = Path("/proc/self/statm").read_text(encoding="utf-8").split()[1]
            resident.append((len(compiled), int(pages)))

    jax.monitoring.register_event_duration_secs_listener(
        lambda name, *_, **__: (
            compiled.append(name) if "backend_compile" in name else None
        )
    )
    run(tmp_path / "run", on_progress=watch, iterations=iterations, checkpoint_every=20)
    early, late = resident[30], resident[-1]
    assert late[0] == early[0] > 0
    assert late[1] <= growth * early[1]


def test_state_in_memory_is_what_is_saved(straight):
    """The checkpoint holds worlds and key, not only the learner."""
    arrays = leaves(straight[0])[1]
    assert {name.split("/")[0] for name in arrays} == {"train", "worlds", "key"}
    assert {"worlds/memory/key", "worlds/memory/t", "worlds/obs/state"} <= set(arrays)
