"""What is refused in a specification before anything is trained."""

import pytest
from support.sweep_setup import sweep

from envs.errors import InputError
from fingers_mjx.evaluation.direction import BETTER
from fingers_mjx.studies.sweep import check
from fingers_mjx.studies.sweep.resolve import SPEC_FILE, keep_sweep
from fingers_mjx.training import memory

SPACE = {"ppo.clip": {"low": 0.1, "high": 0.3}}
HAND = "text: the name of a hand file, or null"


def kept(tmp_path, **changes):
    root = tmp_path / "sweep"
    root.mkdir(exist_ok=True)
    return keep_sweep(sweep(**changes), tmp_path / "written.yaml", root)


def refused(tmp_path, **changes):
    """Returns the error of a specification, which names its file."""
    with pytest.raises(InputError) as error:
        kept(tmp_path, **changes)
    assert error.value.source == tmp_path / "written.yaml"
    assert not (tmp_path / "sweep" / SPEC_FILE).exists()
    return error.value


def stages(**of_b):
    return [{"name": "a"}, {"name": "b", "set": of_b}]


@pytest.mark.parametrize(
    ("change", "field", "valid"),
    [
        ({"task": "krawl"}, "task", "did you mean crawl"),
        ({"task": "krawl", "promote": {"top": 3}}, "task", "did you mean crawl"),
        ({"preset": "cpuu"}, "preset", "did you mean cpu"),
        ({"backend": "warpp"}, "backend", "one of cpu, jax, warp"),
        ({"evaluate": {"backend": "cpuu"}}, "evaluate.backend", "did you mean cpu"),
        ({"configurations": {"b": {"hand": 5}}}, "configurations.b.hand", HAND),
        ({"configurations": {"b": {"hand": ["x"]}}}, "configurations.b.hand", HAND),
        (
            {"configurations": {"lift": {"env.weight.lift": 5.0}}},
            "configurations.lift.env.weight",
            "did you mean weights",
        ),
        (
            {"configurations": {"lift": {"ppo.actor_layers": ["x"]}}},
            "configurations.lift.ppo.actor_layers.0",
            "whole number",
        ),
        (
            {"stages": stages(**{"ppo.actor_layers": [32]})},
            "stages.b.set.ppo.actor_layers",
            "[8], as stage a",
        ),
        (
            {"stages": stages(**{"ppo.critic_layers": [8, 8]})},
            "stages.b.set.ppo.critic_layers",
            "[8], as stage a",
        ),
        (
            {"seeds": 2, "promote": {"top": 1, "seeds": [1, 2]}},
            "promote.seeds",
            "seeds other than those of the sweep",
        ),
        (
            {"promote": {"by": "energy_j"}},
            "promote.by",
            "any measure with better",
        ),
    ],
)
def test_what_cannot_work_is_refused_by_file_and_field(tmp_path, change, field, valid):
    error = refused(tmp_path, **change)
    assert error.field == field
    assert valid in error.valid


def test_a_hand_is_not_drawn_from_a_range(tmp_path):
    search = {"samples": 2, "space": {"hand": {"low": 0.0, "high": 1.0}}}
    error = refused(tmp_path, search=search, configurations={})
    assert (error.field, error.valid) == ("configurations.sample-00.hand", HAND)


@pytest.mark.parametrize("field", ["backend", "evaluate.backend"])
def test_warp_must_be_there(tmp_path, monkeypatch, field):
    monkeypatch.setattr(check, "find_spec", lambda name: None)
    place, _, inner = field.partition(".")
    error = refused(tmp_path, **{place: {inner: "warp"} if inner else "warp"})
    assert (error.field, error.found) == (field, "warp")
    assert "installed" in error.valid


def test_warp_on_a_cluster_is_not_asked_for_here(tmp_path, monkeypatch):
    monkeypatch.setattr(check, "find_spec", lambda name: None)
    spec = sweep(backend="warp", engine="ray", address="10.0.0.1:6379")
    check.check_words(spec, tmp_path, "warp")


def test_stages_of_the_same_networks_and_new_seeds_are_fine(tmp_path):
    more = {"by": "task_speed_mps", "seeds": [2, 3]}
    changes = {"stages": stages(**{"ppo.clip": 0.1}), "promote": more}
    assert kept(tmp_path, **changes).promote is not None


@pytest.mark.parametrize("task", BETTER)
def test_promotion_is_by_the_main_measure_of_the_task(tmp_path, task):
    search = {"samples": 4, "seed": 0, "space": SPACE}
    promote = {"top": 3, "seeds": 6}
    spec = kept(tmp_path, task=task, search=search, promote=promote, configurations={})
    assert spec.promote is not None
    assert (spec.promote.by, spec.promote.top) == (next(iter(BETTER[task])), 3)
    assert len(spec.configurations) == 4


def test_a_task_without_a_main_measure_lists_the_known_ones(tmp_path, monkeypatch):
    monkeypatch.delitem(BETTER, "crawl")
    error = refused(tmp_path, promote={"top": 3, "seeds": 6})
    assert (error.field, error.found) == ("promote.by", "")
    assert "one of survival, undesired_contact_rate" in error.valid


def test_a_member_that_no_memory_here_can_hold_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(memory, "machine_bytes", lambda: 10**9)
    large = {"configurations": {"small": {}, "large": {"num_envs": 2**20}}}
    error = refused(tmp_path, **large)
    assert "GB of memory needed" in error.found and "1.0 GB here" in error.valid
    kept(tmp_path, **large, engine="ray", address="ray://127.0.0.1:10001")
