import jax
import jax.numpy as jnp
import numpy as np
import pytest

from envs.errors import InputError
from envs.tasks.push.camera import (
    CameraConfig,
    Frame,
    read_camera,
    start_camera,
    step_camera,
)

DT = 0.02
STEPS = 400
CLEAN = CameraConfig(dropout=0.0, position_noise_m=0.0, heading_noise_rad=0.0)


def truth(t_s):
    """A scene whose position is the time: x = t in both bodies."""
    t_s = jnp.asarray(t_s, jnp.float32)
    return Frame(t_s, jnp.array([t_s, 0, 0]), jnp.array([t_s, 1, 0]), 3.0 * t_s)


def watch(config, seed=0):
    """The frames delivered at the control steps 1, 2, …"""
    print(f"seed {seed}")
    key = jax.random.key(seed)

    def body(camera, step):
        camera = step_camera(
            jax.random.fold_in(key, step), config, camera, truth(step * DT)
        )
        return camera, read_camera(camera)

    start = start_camera(key, config, truth(0.0))
    _, frames = jax.lax.scan(body, start, jnp.arange(1, STEPS + 1))
    return start, jax.tree.map(np.asarray, frames)


@pytest.mark.parametrize("seed", range(4))
def test_samples_are_held_and_late(seed):
    start, frames = watch(CLEAN, seed)
    age = (np.arange(1, STEPS + 1) * DT - frames.t_s)[10:]
    late = int(start.latency) * DT
    assert late in (DT, 2 * DT, 3 * DT)
    assert age.min() >= late - 1e-4 and age.max() <= late + 1 / 60 + 1e-4
    assert np.ptp(age) > 0.8 / 60
    # Exposures lie on the camera's own clock, at most 60 of them in a second.
    count = (frames.t_s[10:] - float(start.phase_s)) * 60
    np.testing.assert_allclose(count, np.round(count), atol=2e-3)
    np.testing.assert_allclose(frames.object_pos_w[10:, 0], frames.t_s[10:], atol=1e-4)


def test_each_latency_occurs():
    starts = jax.vmap(lambda k: start_camera(k, CLEAN, truth(0.0)).latency)
    latency = np.asarray(starts(jax.random.split(jax.random.key(0), 300)))
    assert set(latency) == {1, 2, 3}


def test_headings_turn_the_shorter_way():
    _, frames = watch(CLEAN)
    error = frames.heading_rad - 3.0 * frames.t_s
    wrapped = np.arctan2(np.sin(error), np.cos(error))
    assert np.abs(wrapped[10:]).max() < 1e-3


def test_lost_frames_leave_the_one_before():
    _, kept = watch(CLEAN)
    _, lossy = watch(CameraConfig(0.0 + 60, (1, 3), 0.3, 0.0, 0.0))
    fresh = [np.diff(f.t_s[10:]) > 0 for f in (kept, lossy)]
    assert fresh[0].all()
    assert np.mean(~fresh[1]) == pytest.approx(0.3, abs=0.08)


def test_noise_has_the_given_size():
    config = CameraConfig(dropout=0.0)
    _, frames = watch(config)
    error = frames.object_pos_w - np.stack(
        [frames.t_s, 0 * frames.t_s, 0 * frames.t_s], 1
    )
    assert error[10:].std() == pytest.approx(0.002, rel=0.15)
    assert np.abs(np.corrcoef(error[10:, 0], error[10:, 1])[0, 1]) < 0.2


def test_a_slow_camera_holds_its_frames():
    _, frames = watch(CameraConfig(10.0, (0, 0), 0.0, 0.0, 0.0))
    assert np.mean(np.diff(frames.t_s) > 0) == pytest.approx(0.2, abs=0.02)


def test_latencies_out_of_order_are_refused():
    with pytest.raises(InputError, match="latency_steps"):
        CameraConfig(latency_steps=(3, 1))
