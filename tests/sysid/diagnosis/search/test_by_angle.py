"""When the angle is searched itself, and what counts of that."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sysid.diagnosis.search import by_angle
from sysid.diagnosis.search import search as search_module
from sysid.diagnosis.search.by_angle import unsolved
from sysid.diagnosis.search.remains import leaves_much


def model(error, effects=()):
    return SimpleNamespace(effects=effects, errors=np.array([0.0, error]))


def judge_of(repeat=True, seen=True):
    """A judge that sees models as they are."""
    output = SimpleNamespace(repeat=repeat, stages={}) if seen else "equations"
    judge: Any = SimpleNamespace(problem="equations", output=output)
    judge.moved, judge.serving = (lambda m: m), (lambda m: judge)
    return judge


def test_much_is_more_than_noise_and_than_what_a_model_errs_by():
    assert leaves_much(6.2, 6.2)
    assert not leaves_much(1.6, 1.6)
    assert not leaves_much(100.0, 10.0)
    assert leaves_much(100.0, 30.0)


@pytest.mark.parametrize(
    ("base", "best", "repeat", "searched"),
    [
        (6.2, 6.2, True, True),
        (6.2, 6.2, False, True),  # noise is what neighbouring readings do not share
        (1.2, 1.2, False, True),  # and taken too large
        (0.9, 0.9, False, False),
        (1.2, 1.2, True, False),
        (1.8, 1.8, True, True),  # too little to be unexplained, and worth a search
        (9.0, 1.1, True, False),
    ],
)
def test_an_angle_that_no_answer_explains_is_searched_itself(
    base, best, repeat, searched, monkeypatch
):
    monkeypatch.setattr(by_angle, "OutputProblem", SimpleNamespace)
    judge, stage, nominal = judge_of(repeat), [model(1.0)], model(base)
    best = nominal if best == base else model(best, ("deadband",))
    found = unsolved(judge, nominal, best, stage)
    assert (found is not None) == searched
    if found is not None:
        assert found == (judge.output, nominal)
        assert judge.output.stages == {(): stage}
    assert unsolved(judge_of(seen=False), nominal, best, stage) is None


@pytest.mark.parametrize(
    ("before", "first", "left", "counts"),
    [
        (6.2, 6.2, 1.5, True),
        (6.2, 6.2, 5.9, False),
        (2.4, 2.4, 1.9, False),
        (3.4, 2.4, 1.5, True),
        (3.4, 1.7, 1.5, False),  # the equations' answer is about as near
    ],
)
def test_a_search_of_the_angle_counts_if_it_explains(
    before, first, left, counts, monkeypatch
):
    base, best = model(before), model(left, ("compliance",))
    again = SimpleNamespace(base=base, best=best)
    monkeypatch.setattr(search_module, "unsolved", lambda *args: ("angle", base))
    monkeypatch.setattr(search_module, "_searched", lambda problem, model: again)
    parts = {"judge": judge_of(), "base": base, "best": model(first), "rejected": []}
    found: Any = SimpleNamespace(**parts)
    assert (search_module._by_angle(found) is again) == counts
