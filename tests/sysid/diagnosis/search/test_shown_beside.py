"""A scale of an encoder counts by what goes of the error of the joint beside it."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sysid.diagnosis import diagnose
from sysid.diagnosis.measured.in_time import Sensor
from sysid.diagnosis.search import shown_beside
from sysid.diagnosis.search.search import Examined, Search


def model(*effects, error=1.0):
    fit = SimpleNamespace(theta=np.array([error]))
    return SimpleNamespace(effects=effects, fit=fit, errors=np.array([0.0, error]))


SCALE = model("encoder_scale")


def search_with(best, error, rejected=()) -> Any:
    """A search whose simulated angle errs by so many squares of its noise."""
    values = {
        "sensor_latency": {"latency_s": np.zeros(1)},
        "clock_drift": {"drift_ppm": np.zeros(1)},
        "encoder_scale": {"scale": np.array([1.3])},
    }
    output = SimpleNamespace(raw=lambda thetas, weigh: np.sqrt(thetas), space=None)
    judge: Any = SimpleNamespace(output=output, prefers=lambda *models: True)
    judge.moved = lambda m: m
    judge.serving = lambda m: judge
    space = SimpleNamespace(values=lambda thetas: (values, None))
    best = model(*best, error=error)
    parts = (best, {}, {}, list(rejected), 100, judge)
    return Search(SimpleNamespace(space=space), model(error=error), *parts)


@pytest.mark.parametrize(
    ("rejected", "gains", "found"),
    [
        ([SCALE, model("damping")], True, True),
        ([model("damping"), SCALE], True, False),  # something else comes nearer
        ([SCALE], False, False),
        ([], True, False),
    ],
)
def test_a_scale_that_is_first_is_suspected(rejected, gains, found, monkeypatch):
    monkeypatch.setattr(shown_beside, "accepted", lambda *models: gains)
    suspect = shown_beside.suspected(search_with((), 1.0, rejected))
    assert (suspect is SCALE) == found


@pytest.mark.parametrize(
    ("before", "after", "causes", "solved"),
    [
        (2.05, 0.4, (), True),
        (2.05, 1.7, (), False),  # no quarter of its square goes
        (9.0, 4.0, (), False),  # too much is left
        (2.05, 0.4, ("joint_coupling",), False),  # by a cause of its own
    ],
)
def test_what_solves_the_motion_beside_it(before, after, causes, solved):
    first, again = search_with((), before), search_with(causes, after)
    assert shown_beside.solved(first, again) == solved


@pytest.mark.parametrize("after", [0.4, 1.9])
def test_a_scale_is_named_if_the_joint_beside_it_is_solved(after, monkeypatch):
    """Its own joint shows it, but misses the share that a cause has to take."""
    sensors = []

    def tracks(logs, mechanism, read):
        sensors.append(read)
        return [SimpleNamespace(joint=name) for name in "ab"]

    def examined(name, found) -> Examined:
        return Examined(SimpleNamespace(joint=name), None, found)

    again = examined("b", search_with((), after))
    monkeypatch.setattr(diagnose, "all_tracks", tracks)
    monkeypatch.setattr(diagnose, "_examined", lambda *parts: again)
    monkeypatch.setattr(diagnose, "unsolved_beside", lambda found: True)
    monkeypatch.setattr(shown_beside, "accepted", lambda *models: True)
    first = [
        examined("a", search_with((), 0.7, [SCALE, model("damping")])),
        examined("b", search_with((), 2.05)),
    ]
    a, b = diagnose.beside_misread(first, [], None)
    assert sensors == [{"a": Sensor(scale=1.3)}]
    if after > 1.0:
        assert [a, b] == first
    else:
        assert a.found.best is SCALE and b is again
        assert list(a.found.alternatives) == ["encoder_scale"]
