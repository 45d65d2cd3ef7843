"""A walking task carries and steps what its reward table binds, and nothing else."""

from types import SimpleNamespace

import jax.numpy as jnp
import numpy as np
import pytest

from envs.memory import Memory
from envs.rotations import unrotate
from envs.tasks.crawl import Crawl, CrawlConfig
from rewards import STOCK, TABLES, AirTimeMemory

STOCKED = Crawl(CrawlConfig(rewards="stock"))
NO_FORCE, FORCE = np.zeros(5, np.float32), np.full(5, 0.2, np.float32)


def landed(force_n, speed_mps):
    signals = {
        "tip_force_n": jnp.array(force_n),
        "command": jnp.array([speed_mps, 0, 0]),
    }
    return SimpleNamespace(**signals)


def test_a_table_carries_what_it_binds():
    ours = Crawl(CrawlConfig())
    assert ours.table == TABLES["crawl"]["footprint"]
    assert (set(ours.begin_world()), set(ours.begin_gait())) == (
        {"footprint"},
        {"lift"},
    )
    assert STOCKED.table == STOCK
    assert (set(STOCKED.begin_world()), set(STOCKED.begin_gait())) == (
        set(),
        {"air_time"},
    )


def test_a_new_command_begins_the_lift_memory_anew_and_not_the_air_time():
    assert set(Crawl(CrawlConfig()).begin_with_command()) == {"lift"}
    assert STOCKED.begin_with_command() == {}


@pytest.mark.parametrize(
    ("force_n", "speed_mps", "paid_s", "kept_s"),
    [
        (FORCE, 0.16, 5 * (0.72 - 0.5), 0.0),
        (FORCE, 0.09, 0.0, 0.0),  # Isaac Lab pays above 0.1 m/s
        (NO_FORCE, 0.16, 0.0, 0.72),
    ],
)
def test_air_time_is_paid_at_touchdown(force_n, speed_mps, paid_s, kept_s):
    memory = AirTimeMemory(jnp.full(5, 0.70))
    before = Memory(*[None] * 7, air_time=memory)
    signals = landed(force_n, speed_mps)
    after, magnitudes = STOCKED.magnitudes(before, signals, jnp.array(True))
    assert set(magnitudes) == {"air_time_magnitude"}
    assert magnitudes["air_time_magnitude"] == pytest.approx(paid_s, abs=1e-6)
    np.testing.assert_allclose(after.air_time.air_time_s, kept_s, atol=1e-6)


def test_gravity_in_v_points_down_in_the_stance_and_only_where_it_is_bound(crawl):
    plant = crawl.batch.plant
    root = jnp.array(plant.stance.root_quat_w)
    stands = SimpleNamespace(gravity_b=unrotate(root, jnp.array([0.0, 0.0, -1.0])))
    extra = STOCKED.scene_signals(plant, {}, stands, None)
    np.testing.assert_allclose(extra["gravity_v"], [0, 0, -1], atol=1e-5)
    assert Crawl(CrawlConfig()).scene_signals(plant, {}, stands, None) == {}
