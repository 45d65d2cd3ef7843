"""Comparisons of some seeds each, joined to that of all."""

import json

import numpy as np
import pytest

from benchmarks.claims.gain import joined, main
from envs.errors import InputError
from fingers_mjx.studies.transfer import gains

ARMS = ("default", "extended")
POLICY = {"task": "crawl", "seed": 0, "steps_trained": 100}


def part(seeds, generator=None, **changed):
    """A comparison of policies whose means and names are drawn."""
    generator = generator or np.random.default_rng(0)
    measures = ("task_speed_mps", "drift_deg_s", "survival")
    values: dict[str, dict[str, list]] = {
        name: {
            arm: [float(x) for x in generator.normal(size=len(seeds))] for arm in ARMS
        }
        for name in measures
    }
    values["survival"]["extended"][0] = None
    return {
        "seeds": list(seeds),
        "policies": {
            arm: [POLICY | changed | {"policy_sha256": name} for name in names]
            for arm, names in zip(ARMS, generator.random((2, len(seeds))), strict=True)
        },
        "gain": gains(values, seeds, "crawl"),
        "conditions": {"episodes": 64, "steps": 500, "real_sha256": "a"},
    }


def test_joined_parts_say_what_the_whole_says():
    generator = np.random.default_rng(1)
    parts = {"a": part(range(3), generator), "b": part(range(2), generator)}
    found = joined(parts)
    together = {
        name: {
            arm: [x for one in parts.values() for x in one["gain"][name]["values"][arm]]
            for arm in ARMS
        }
        for name in parts["a"]["gain"]
    }
    assert found["gain"] == gains(together, range(5), "crawl")
    assert found["gain"]["task_speed_mps"]["n"] == 5
    assert found["gain"]["survival"]["n"] == 3
    gain, alone = (one["gain"]["task_speed_mps"] for one in (found, parts["a"]))
    assert gain["mean"] != alone["mean"]
    assert (found["seeds"], len(found["policies"]["default"])) == ([0, 1, 2, 3, 4], 5)


@pytest.mark.parametrize("field", ["steps_trained", "seed", "task"])
def test_parts_that_were_not_compared_alike_are_refused(field):
    other = part(range(2), **{field: 7 if field != "task" else "push"})
    with pytest.raises(InputError, match="conditions"):
        joined({"a": part(range(2)), "b": other})


def test_a_policy_that_is_there_twice_is_no_second_seed():
    with pytest.raises(InputError, match="default: policies: found one of them twice"):
        joined({"a": part(range(2)), "b": part(range(2))})


def test_parts_with_other_measures_are_refused():
    other = part(range(2), np.random.default_rng(1))
    del other["gain"]["survival"]
    with pytest.raises(InputError, match="as in a"):
        joined({"a": part(range(2)), "b": other})


def test_another_hand_is_refused():
    other = part(range(2))
    other["conditions"]["real_sha256"] = "b"
    with pytest.raises(InputError, match="as in a"):
        joined({"a": part(range(2)), "b": other})


def test_the_command_shows_and_writes_it(tmp_path, capsys):
    generator = np.random.default_rng(2)
    for name in "ab":
        document = json.dumps(part(range(2), generator))
        (tmp_path / f"{name}.json").write_text(document)
    out = tmp_path / "whole.json"
    main([str(tmp_path / "a.json"), str(tmp_path / "b.json"), "--out", str(out)])
    assert "trainings on each: 4" in capsys.readouterr().out
    assert json.loads(out.read_text())["seeds"] == [0, 1, 2, 3]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (None, "found"),
        ("no JSON", "found"),
        ("[1]", "conditions: found only"),
        ('{"seeds": [], "gain": {}}', "conditions: found only"),
    ],
)
def test_a_file_that_is_no_comparison_is_refused_by_name(tmp_path, capsys, text, said):
    path = tmp_path / "transfer.json"
    if text is not None:
        path.write_text(text)
    assert main([str(path), "--out", str(tmp_path / "whole.json")]) == 2
    error = capsys.readouterr().err
    assert f"gain: {path}" in error and said in error
    assert "transfer.json of `fingers sysid transfer --policies`" in error
    assert len(error.splitlines()) == 1
