"""A few of the bad inputs of `benchmarks.inputs.fuzz`, which has five thousand."""

import pytest

from benchmarks.inputs.fuzz import report
from benchmarks.inputs.trial import Trials

FEW, MANY, SEED = 120, 3000, 1


@pytest.fixture(scope="module")
def trials(tmp_path_factory):
    """In the process of the tests, which has imported everything anyway."""
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path_factory.mktemp("here"))
        yield Trials(tmp_path_factory.mktemp("inputs"), SEED)


def wrong(results):
    """What was not refused as it must be; how long it took says little in here."""
    return [r for r in results if r.wrong and not r.verdict.startswith("took")]


def test_bad_inputs_are_refused_in_one_sentence_and_nothing_is_written(trials):
    results = [trials.run(number) for number in range(FEW)]
    assert wrong(results) == []
    assert report(results, SEED)["refused"] > 0.8 * FEW


@pytest.mark.slow
def test_more_bad_inputs(trials):
    print(f"seed {SEED}, inputs {FEW} to {MANY - 1}")
    assert wrong([trials.run(number) for number in range(FEW, MANY)]) == []


def test_the_same_number_is_the_same_input(trials):
    assert trials.run(7).name == trials.run(7).name != trials.run(10).name


def test_what_is_not_refused_would_be_found(trials, monkeypatch):
    """Negative control: a reader that takes everything, and a command that raises."""
    import benchmarks.inputs.trial as module

    taken = {
        name: (file, lambda path: None) for name, (file, _) in trials._readers.items()
    }
    monkeypatch.setattr(trials, "_readers", taken)
    verdicts = {trials.run(3 * k).verdict for k in range(20)}
    assert "not refused" in verdicts
    monkeypatch.setattr(module, "fingers", lambda words: {}["no such key"])
    assert any("KeyError" in trials.run(3 * k + 2).verdict for k in range(20))
