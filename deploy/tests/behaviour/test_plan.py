import numpy as np
import pytest

from fingers_deploy.errors import InputError
from fingers_robot.behaviour.exchange import Query
from fingers_robot.behaviour.plan import Plan, read_plan


def _write(path, interface, header=None, rows=None):
    low, high = interface.joint_limits_rad[3]
    middle = (low + high) / 2
    header = header or "t,cmd.finger1_joint4"
    rows = rows or [(0.0, middle), (0.5, middle + 0.1), (1.0, middle)]
    path.write_text(header + "\n" + "\n".join(",".join(map(str, r)) for r in rows))
    return path, middle


def test_a_plan_is_played_within_the_step_of_the_policy(interface, tmp_path):
    path, middle = _write(tmp_path / "plan.csv", interface)
    plan = Plan(read_plan(path, interface), interface)
    target, reached = np.asarray(interface.initial_target_rad, float), []
    for k in range(120):
        query = Query(k, 0.02 * k, target, np.ones(4), np.zeros(3), target, k >= 10)
        proposal = plan.answer(query).proposal
        assert np.abs(proposal.target_rad - target).max() <= 0.06 + 1e-9
        if k < 10:
            np.testing.assert_array_equal(proposal.target_rad, target)
        target = proposal.target_rad.copy()
        reached.append(target[3])
    assert reached[10 + 25] == pytest.approx(middle + 0.1, abs=1e-6)
    assert reached[-1] == pytest.approx(middle)
    others = np.delete(target, 3)
    np.testing.assert_allclose(others, np.delete(interface.initial_target_rad, 3))


@pytest.mark.parametrize(
    ("header", "rows", "words"),
    [
        ("time,cmd.finger1_joint4", None, "header"),
        ("t,cmd.thumb", None, "thumb"),
        (None, [(0.0, 0.1), (0.0, 0.1)], "increase"),
        (None, [(0.0, 9.0), (1.0, 9.0)], "outside"),
        (None, [(0.0, 0.0), (0.001, 0.1)], "rad/s"),
        (None, [(0.0, "nan"), (1.0, 0.1)], "finite"),
        (None, [(0.0, "left"), (1.0, 0.1)], "left"),
        (None, [(0.0, 0.1)], "lines"),
        (None, [(0.0, 0.1), (1.0, 0.1, 0.1)], "cells"),
    ],
)
def test_other_plans_are_refused(interface, tmp_path, header, rows, words):
    path, _ = _write(tmp_path / "plan.csv", interface, header, rows)
    with pytest.raises(InputError, match=words) as caught:
        read_plan(path, interface)
    assert "\n" not in str(caught.value)


def test_a_missing_plan_is_refused(interface, tmp_path):
    with pytest.raises(InputError, match="nowhere"):
        read_plan(tmp_path / "nowhere.csv", interface)
