"""Readings of a late sensor, and the joints beside it."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sysid.diagnosis import diagnose
from sysid.diagnosis.measured.in_time import Sensor, in_time
from sysid.diagnosis.measured.segments import Piece

AGE = Sensor(latency_s=0.03, drift=1e-3)


def test_late_readings_are_put_to_when_they_were_taken():
    t_s = 5.0 + np.arange(0.0, 10.0, 0.005)
    since = t_s - t_s[0]
    seen = np.sin(2.0 * (since * (1.0 - AGE.drift) - AGE.latency_s))
    two = np.stack([seen, seen], 1)
    rest = dict.fromkeys(Piece.__dataclass_fields__, two)
    piece = Piece(**(rest | {"t_s": t_s, "log": 0, "every": 1, "row_s": 0.005}))
    (found,) = in_time([piece], ("a", "b"), {"b": AGE})
    right = np.sin(2.0 * since)[:-20]
    for name in ("pos", "vel", "acc", "effort"):
        np.testing.assert_allclose(getattr(found, name)[:-20, 1], right, atol=1e-4)
        np.testing.assert_array_equal(getattr(found, name)[:, 0], seen)
    np.testing.assert_array_equal(found.cmd, two)


def test_what_an_encoder_counts_too_much_goes_and_torques_stay():
    seen = np.linspace(0.5, 2.0, 50)[:, None]
    rest = dict.fromkeys(Piece.__dataclass_fields__, seen)
    piece = Piece(**(rest | {"t_s": 0.01 * np.arange(50), "log": 0, "every": 1}))
    (found,) = in_time([piece], ("a",), {"a": Sensor(scale=1.25)})
    for name in ("pos", "vel", "acc"):
        np.testing.assert_allclose(getattr(found, name), seen / 1.25)
    np.testing.assert_allclose(found.effort, seen)


def examined(joint, effects=(), left=0.0):
    """What was done with a joint of which some error is left."""
    values = {
        "sensor_latency": {"latency_s": np.array([AGE.latency_s])},
        "clock_drift": {"drift_ppm": np.array([1e6 * AGE.drift])},
        "encoder_scale": {"scale": np.array([1.0])},
    }
    problem = SimpleNamespace(
        raw=lambda thetas, weigh: np.array([left]),
        space=SimpleNamespace(values=lambda thetas: (values, None)),
    )
    fit = SimpleNamespace(theta=np.zeros(1))
    best = SimpleNamespace(effects=effects, fit=fit, errors=np.ones(2))
    judge: Any = SimpleNamespace(output=problem, moved=lambda model: model)
    judge.serving = lambda model: judge
    found = SimpleNamespace(problem=problem, best=best, judge=judge, rejected=[])
    return SimpleNamespace(track=SimpleNamespace(joint=joint), search=found)


@pytest.mark.parametrize(("effect", "asked"), [("sensor_latency", 1), ("damping", 0)])
@pytest.mark.parametrize(("after", "better"), [(0.1, True), (0.9, False)])
def test_joints_beside_a_late_one_are_examined_again(
    effect, asked, after, better, monkeypatch
):
    """And are as they were before unless that explains more of their motion."""
    late = []

    def tracks(logs, mechanism, ages):
        late.append(ages)
        return ["a", "b"]

    monkeypatch.setattr(diagnose, "all_tracks", tracks)
    monkeypatch.setattr(
        diagnose, "_examined", lambda track, logs, mechanism: examined("b", left=after)
    )
    before = [examined("a", (effect,)), examined("b", left=0.5)]
    joints = diagnose.beside_misread(before, [], None)
    assert late == asked * [{"a": AGE}]
    assert joints[0] is before[0]
    assert (joints[1] is not before[1]) == bool(asked and better)
