import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from envs.randomize import RandomizeConfig, no_randomization
from envs.sensing import imu_of, sense

NONE = no_randomization(0.88)


@pytest.fixture(scope="module")
def world(crawl):
    """Memory, physics state and reference of one world."""
    memory, data = jax.tree.map(lambda x: x[0], (crawl.first.memory, crawl.first.data))
    still = jax.tree.map(jnp.zeros_like, memory.world.variation)
    kept = memory.world.replace(variation=still)
    return kept, data, jnp.array(crawl.batch.stance.joint_pos_rad)


@pytest.fixture(scope="module")
def read(world):
    kept, data, reference = world

    def take(config, data=data, **changes):
        own = kept.replace(**changes)
        imu = imu_of(data, jnp.array([0.0, 0.0, -1.0]))
        return sense(config, own, data.qpos[7:] - reference, imu, jnp.full(20, 0.25))

    return take


def test_without_noise_it_is_the_state_itself(read, world):
    _, data, reference = world
    sample = read(NONE)
    np.testing.assert_array_equal(sample.joint_pos, data.qpos[7:] - reference)
    np.testing.assert_allclose(sample.angvel, data.qvel[3:6], atol=1e-7)
    np.testing.assert_allclose(jnp.linalg.norm(sample.gravity), 1.0, atol=1e-6)
    np.testing.assert_array_equal(sample.action, 0.25)
    assert sample.inputs == {}


@pytest.mark.parametrize("turn", [0.0, 2.0])
def test_gravity_and_gyro_are_in_the_palm_frame(read, world, turn):
    """A palm turned by a quarter about world x sees gravity along its -y, and so on."""
    data = world[1]
    half = np.sqrt(0.5)
    quats = {(0, 0, -1): [1, 0, 0, 0], (0, -1, 0): [half, half, 0, 0]}
    quats |= {(1, 0, 0): [half, 0, half, 0], (0, 0, 1): [0, 1, 0, 0]}
    heading = np.array([np.cos(turn / 2), 0, 0, np.sin(turn / 2)])
    for down, quat in quats.items():
        w, z = heading[0], heading[3]
        a, b, c, d = quat
        turned = jnp.array([w * a - z * d, w * b - z * c, w * c + z * b, w * d + z * a])
        placed = data.replace(
            qpos=data.qpos.at[3:7].set(turned),
            qvel=data.qvel.at[3:6].set(jnp.array([1.0, 2.0, 3.0])),
        )
        sample = read(NONE, data=placed)
        np.testing.assert_allclose(sample.gravity, down, atol=1e-6)
        np.testing.assert_allclose(sample.angvel, [1.0, 2.0, 3.0], atol=1e-6)


@pytest.mark.parametrize(
    ("changed", "term"),
    [
        ("joint_noise_rad", "joint_pos"),
        ("gravity_noise", "gravity"),
        ("gyro_noise_rps", "angvel"),
    ],
)
def test_one_noise_moves_no_other(read, changed, term):
    full = RandomizeConfig()
    without = dataclasses.replace(full, **{changed: 0.0})
    a, b = vars(read(full)), vars(read(without))
    assert {k for k in a if not np.array_equal(a[k], b[k])} == {term}


def test_noise_is_fresh_in_each_step_episode_and_world(read):
    config = RandomizeConfig()
    first = read(config)
    np.testing.assert_array_equal(read(config).joint_pos, first.joint_pos)
    changes = [{"total_steps": jnp.int32(1)}, {"episodes": jnp.int32(1)}]
    for change in [*changes, {"key": jax.random.key(1)}]:
        other = read(config, **change)
        for name in ("joint_pos", "gravity", "angvel"):
            assert not np.isclose(getattr(other, name), getattr(first, name)).all()
