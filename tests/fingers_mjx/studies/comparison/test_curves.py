import numpy as np
import pytest
from support.synthetic_sweep import ITERATIONS, STEPS, study, write_sweep

from fingers_mjx.studies.comparison.curves import Curve, band, read_curves
from fingers_mjx.studies.sweep.manifest import read_manifest

RETURN = "episode/return"


def test_stages_follow_each_other(tmp_path):
    states = {("lift", 1): ("failed", "")}
    path = write_sweep(tmp_path / "s", study({"lift": 0.02}, 2), states)
    found = read_curves(path, read_manifest(path))
    assert [(c.configuration, c.seed, c.done) for c in found] == [
        ("base", 0, True),
        ("base", 1, True),
        ("lift", 0, True),
        ("lift", 1, False),
    ]
    steps, values = found[0].of(RETURN)
    assert len(steps) == len(values) == 2 * ITERATIONS
    assert steps[-1] == 2 * STEPS
    assert (np.diff(steps) > 0).all()
    assert found[3].of(RETURN)[0][-1] == 1.5 * STEPS


def curve(steps, values):
    rows = [{"env_steps": s, RETURN: v} for s, v in zip(steps, values, strict=True)]
    return Curve("a", 0, True, rows)


def test_a_band_is_where_all_seeds_are():
    found = band([curve([0, 10], [0, 10]), curve([2, 8], [4, 10])], RETURN)
    assert (found.steps[0], found.steps[-1]) == (2, 8)
    np.testing.assert_allclose(found.mean, found.steps + 1)
    assert (found.low < found.mean).all() and (found.mean < found.high).all()


@pytest.mark.parametrize(
    "curves",
    [[], [curve([0, 1], [0, 1])], [curve([0, 1], [0, 1]), curve([2, 3], [0, 1])]],
)
def test_without_two_seeds_that_overlap_there_is_none(curves):
    assert band(curves, RETURN) is None


def test_rows_without_the_metric_are_passed_over():
    one = Curve("a", 0, True, [{"env_steps": 1}, {"env_steps": 2, RETURN: 3.0}])
    assert [list(x) for x in one.of(RETURN)] == [[2.0], [3.0]]
