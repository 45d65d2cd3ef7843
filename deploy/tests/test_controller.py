import numpy as np
import pytest

from fingers_deploy import BundleError, PolicyController

SEED = 13
GRAVITY = (0.0, 0.0, -1.0)


@pytest.fixture
def controller(bundle):
    return PolicyController(bundle, runtime="numpy")


def _measurements(count):
    rng = np.random.default_rng(SEED)
    return [
        {
            "joint_pos": rng.uniform(-0.5, 1.0, 20),
            "gravity_b": rng.standard_normal(3),
            "angvel_b": rng.standard_normal(3),
            "command": rng.uniform(-0.1, 0.1, 3),
        }
        for _ in range(count)
    ]


def test_closes_the_loop_as_defined(controller, bundle, forward, weights):
    interface = bundle.manifest.interface
    reference = np.asarray(interface.reference_angles_rad)
    limits = np.asarray(interface.joint_limits_rad)
    target = np.asarray(interface.initial_target_rad)
    action, rows = np.zeros(20), []
    for m in _measurements(20):
        rows.append(
            (
                m["joint_pos"] - reference,
                m["gravity_b"],
                0.25 * m["angvel_b"],
                action,
                2.0 * m["command"],
            )
        )
        window = [rows[max(len(rows) - 8 + i, 0)] for i in range(8)]
        obs = np.concatenate(
            [np.concatenate(term) for term in zip(*window, strict=True)]
        )
        action = forward(weights, obs.astype(np.float32))
        target = np.clip(target + 0.06 * np.tanh(action), limits[:, 0], limits[:, 1])
        found = controller.step(**m)
        np.testing.assert_allclose(controller.observation, obs, atol=2e-5)
        np.testing.assert_allclose(found, target, atol=2e-5)
        assert controller.fault == ""


def test_runtimes_agree_over_an_episode(bundle):
    both = [PolicyController(bundle, runtime) for runtime in ("numpy", "onnxruntime")]
    for m in _measurements(20):
        first, second = (controller.step(**m) for controller in both)
        np.testing.assert_allclose(first, second, atol=2e-5)


def test_reset_leaves_nothing_behind(controller):
    first = [controller.step(**m) for m in _measurements(10)]
    controller.reset()
    again = [controller.step(**m) for m in _measurements(10)]
    np.testing.assert_array_equal(first, again)
    controller.reset(np.zeros(20))
    assert np.abs(controller.step(**_measurements(1)[0])).max() <= 0.06


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e39])
@pytest.mark.parametrize("name", ["joint_pos", "gravity_b", "angvel_b", "command"])
def test_a_bad_measurement_holds_and_leaves_no_trace(bundle, name, bad):
    disturbed, clean = (PolicyController(bundle, "numpy") for _ in range(2))
    before = clean.target_rad
    for i, m in enumerate(_measurements(12)):
        if i == 5:
            value = np.asarray(m[name]).copy()
            value[0] = bad
            for count in (1, 2):
                with np.errstate(over="ignore"):
                    held = disturbed.step(**{**m, name: value})
                np.testing.assert_array_equal(held, before)
                assert disturbed.fault and disturbed.faults == count
        before = disturbed.step(**m)
        np.testing.assert_array_equal(before, clean.step(**m))
        assert (disturbed.fault, disturbed.faults) == ("", 0)


def test_a_measurement_that_overflows_the_network_holds(controller):
    before = controller.target_rad
    alternating = 3e38 * (-1.0) ** np.arange(20)
    held = controller.step(alternating, GRAVITY, np.full(3, 3e38), np.full(3, 1e38))
    np.testing.assert_array_equal(held, before)
    assert controller.fault == "non-finite policy output"


def test_returned_targets_are_the_callers(controller):
    m = _measurements(1)[0]
    controller.step(**m)[:] = 99.0
    assert np.all(controller.target_rad < 99.0)


def test_partial_measurements_are_refused(controller):
    with pytest.raises(ValueError, match="joint_pos"):
        controller.step(np.zeros(19), GRAVITY, np.zeros(3), np.zeros(3))
    with pytest.raises(ValueError, match="target"):
        controller.reset(np.full(20, np.nan))


def test_joint_order(controller, interface):
    controller.check_joint_order(list(interface.joint_names))
    with pytest.raises(BundleError, match="joint_names"):
        controller.check_joint_order(list(reversed(interface.joint_names)))
