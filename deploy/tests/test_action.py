import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from fingers_deploy import ActionTransform

ANY = arrays(np.float32, 20, elements=st.floats(width=32))


@pytest.fixture(scope="module")
def transform(interface):
    return ActionTransform(interface)


@pytest.fixture(scope="module")
def limits(interface):
    return np.asarray(interface.joint_limits_rad, np.float64)


def test_property_targets_are_finite_and_within_limits(transform, limits):
    @settings(max_examples=2000, deadline=None)
    @given(target=ANY, action=ANY)
    def check(target, action):
        finite = np.isfinite(target).all() and np.isfinite(action).all()
        try:
            result = transform.step(target, action)
        except ValueError:
            assert not finite
            return
        assert finite
        double = result.astype(np.float64)
        assert np.all((limits[:, 0] <= double) & (double <= limits[:, 1]))

    check()


def test_equals_the_formula_in_double_precision(transform, limits):
    rng = np.random.default_rng(5)
    for _ in range(200):
        target = rng.uniform(limits[:, 0], limits[:, 1]).astype(np.float32)
        action = (4 * rng.standard_normal(20)).astype(np.float32)
        change = 0.06 * np.tanh(np.clip(action.astype(np.float64), -3, 3))
        wanted = np.clip(target + change, limits[:, 0], limits[:, 1])
        np.testing.assert_allclose(transform.step(target, action), wanted, atol=1e-6)


def test_one_step_moves_by_at_most_alpha(transform):
    middle = (transform.low + transform.high) / 2
    farthest = transform.step(middle, np.full(20, 1e30))
    assert np.all(np.abs(farthest - middle) <= 0.06)
    np.testing.assert_allclose(farthest - middle, 0.06 * np.tanh(3.0), atol=1e-6)
    np.testing.assert_array_equal(transform.step(middle, np.zeros(20)), middle)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_non_finite_is_refused(transform, bad):
    action = np.zeros(20)
    action[7] = bad
    for arguments in ((np.zeros(20), action), (action, np.zeros(20))):
        with pytest.raises(ValueError, match="NaN or infinity"):
            transform.step(*arguments)


def test_partial_commands_are_refused(transform):
    for wrong in (np.zeros(19), np.zeros(()), np.zeros((1, 20))):
        with pytest.raises(ValueError, match="valid"):
            transform.step(np.zeros(20), wrong)
