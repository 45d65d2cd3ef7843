"""What a specification may say."""

import pytest
from support.sweep_setup import sweep

from envs.errors import InputError
from fingers_mjx.studies.sweep.spec import free_names, seed_list

STAGES = [{"name": "walk"}, {"name": "adapt", "schedules": "keep"}]


def test_seeds_are_a_list_or_a_number():
    assert seed_list(sweep(seeds=3).seeds) == (0, 1, 2)
    assert seed_list(sweep(seeds=[4, 2]).seeds) == (4, 2)
    assert seed_list(6, after=2) == (3, 4, 5, 6, 7, 8)


def test_what_may_change_between_starts():
    assert free_names() == {
        "promote",
        "engine",
        "processes",
        "address",
        "worlds_at_once",
    }


@pytest.mark.parametrize(
    ("change", "field", "words"),
    [
        ({"sead": 3}, "sead", "did you mean seeds"),
        ({"seeds": []}, "seeds", "no seed"),
        ({"seeds": [1, 1]}, "seeds", "a seed twice"),
        ({"seeds": 0}, "seeds", "no seed"),
        ({"seeds": [-1]}, "seeds.0", "whole number"),
        ({"seeds": 10**9}, "seeds", "at most 4096"),
        ({"engine": "slurm"}, "engine", "population"),
        ({"stages": []}, "stages", "no stage"),
        ({"stages": [*STAGES, {"name": "walk"}]}, "stages.2.name", "another name"),
        ({"stages": [{"name": "a/b"}]}, "stages.0.name", "letters"),
        ({"stages": [{"schedules": "go"}]}, "stages.0.schedules", "keep, restart"),
        ({"stages": [{"schedules": "keep"}]}, "stages.0.schedules", "no stage before"),
        ({"configurations": {"..": {}}}, "configurations", "letters"),
        ({"configurations": {"a": {"seed": 3}}}, "configurations.a.seed", "setting"),
        ({"set": {"hand": "x.yaml"}}, "set.hand", "setting"),
        ({"set": {"backend": "jax"}}, "set.backend", "setting"),
        ({"evaluate": {"set": {"num_envs": 3}}}, "evaluate.set.num_envs", "env.FIELD"),
        ({"grid": {}}, "grid", "no setting"),
        ({"search": {"samples": 4, "space": {}}}, "search.space", "no setting"),
        ({"search": {"samples": 4, "seed": 0}}, "search.space", "mapping"),
        ({"promote": {"by": "x", "seeds": 0}}, "promote.seeds", "no seed"),
    ],
)
def test_what_does_not_fit_is_refused_by_name(change, field, words):
    with pytest.raises(InputError, match=words) as error:
        sweep(**change)
    assert error.value.field == field
