"""The tracker of the robot (NumPy) and of training (JAX) are one."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from envs.hand.stance import load_stance
from envs.rotations import unrotate
from envs.tasks.push import tracking as trained
from envs.tasks.push.camera import Frame
from fingers_robot.behaviour import tracking as deployed

Q_OFF = np.array(load_stance().q_off)
TARGET = np.array([0.3, -0.1, 0.02])
SEED = 7


def frames(count):
    """A cube and a hand that wander, seen at uneven times, now and then twice."""
    print(f"seed {SEED}")
    rng = np.random.default_rng(SEED)
    t_s, pos, root, heading = 0.0, np.array([0.2, 0, 0.02]), np.zeros(3), 3.0
    for _ in range(count):
        if rng.random() > 0.1:
            t_s += rng.choice([1, 1, 2]) / 60
            pos, root = pos + rng.normal(0, 0.003, 3), root + rng.normal(0, 0.003, 3)
            heading = np.angle(np.exp(1j * (heading + rng.normal(0, 0.1))))
        down = np.array([*rng.normal(0, 0.1, 2), -1.0])
        gravity_b = np.array(_palm(down / np.linalg.norm(down)))
        yield t_s, pos, root, heading, gravity_b


def _palm(gravity_v):
    inverse = jnp.array(Q_OFF) * jnp.array([1.0, -1.0, -1.0, -1.0])
    return unrotate(inverse, jnp.asarray(gravity_v))


def both(change=lambda *measured: measured):
    """Largest difference of each entry between the two over 200 steps."""
    tracker = deployed.ObjectTracker(TARGET, Q_OFF)
    step = jax.jit(trained.step_track)
    track, worst = None, np.zeros(9)
    for measured in frames(200):
        t_s, pos, root, heading, gravity_b = measured
        frame = Frame(*(jnp.asarray(x, jnp.float32) for x in (t_s, pos, root, heading)))
        track = trained.start_track(frame) if track is None else step(track, frame)
        gravity_v = unrotate(jnp.array(Q_OFF), jnp.asarray(gravity_b))
        inputs = trained.track_inputs(track, jnp.asarray(TARGET), gravity_v)
        *seen, gravity_b = change(*measured)
        tracker.update(deployed.Frame(*seen))
        ours = np.concatenate([np.asarray(x) for x in inputs.values()])
        worst = np.maximum(worst, np.abs(ours - tracker.inputs(gravity_b)))
    return worst


def test_they_give_the_same_inputs():
    assert both().max() < 1e-5


WRONG = {
    "heading": lambda t, p, r, h, g: (t, p, r, h + 0.05, g),
    "gravity": lambda t, p, r, h, g: (t, p, r, h, g * [1, 1, 0.9]),
    "time": lambda t, p, r, h, g: (2 * t, p, r, h, g),
    "bodies": lambda t, p, r, h, g: (t, r, p, h, g),
}


@pytest.mark.parametrize("name", WRONG)
def test_differences_would_be_seen(name):
    """Negative control."""
    assert both(WRONG[name]).max() > 1e-3


def test_steady_motion_is_reported_as_it_is():
    """In V: the hand looks along world y, so a cube moving along y moves ahead."""
    tracker = deployed.ObjectTracker([0, 0.5, 0.02], [1, 0, 0, 0])
    for step in range(200):
        t_s = step / 60
        frame = deployed.Frame(
            t_s, [0, 0.2 + 0.05 * t_s, 0.02], [0, 0, 0.12], np.pi / 2
        )
        tracker.update(frame)
    inputs = tracker.inputs([0, 0, -1])
    y = 0.2 + 0.05 * 199 / 60
    np.testing.assert_allclose(inputs[:3], [y, 0, -0.1], atol=1e-6)
    np.testing.assert_allclose(inputs[3:6], [0.05, 0, 0], atol=3e-3)
    np.testing.assert_allclose(inputs[6:], [0.5 - y, 0, 0], atol=1e-6)


def test_no_sample_is_no_zero():
    with pytest.raises(ValueError, match="no camera sample"):
        deployed.ObjectTracker(TARGET, Q_OFF).inputs([0, 0, -1])
