"""The state of a diverged run fits in one small file, worst worlds first."""

from types import SimpleNamespace

import jax.numpy as jnp
import numpy as np

from envs.base import State
from fingers_mjx.ppo.health import healthy
from fingers_mjx.training import dump as train_dump
from fingers_mjx.training.dump import dump_state


def carry(worlds, width):
    zero = jnp.zeros(worlds)
    data = jnp.ones((worlds, width)).at[5, 0].set(jnp.nan).at[2, :2].set(jnp.inf)
    state = State(data, {}, zero, zero, {}, {}, None, None)
    parts = {"params": {"w": jnp.ones(3)}, "normalizer": {"m": jnp.ones(2)}}
    train = SimpleNamespace(**parts, health=healthy())
    return SimpleNamespace(train=train, worlds=state)


def test_worst_worlds_come_first(tmp_path):
    path = dump_state(tmp_path / "state.npz", carry(40, 4))
    with np.load(path, allow_pickle=False) as dump:
        assert dump["worlds/index"].tolist() == [
            2,
            5,
            0,
            1,
            *range(3, 5),
            *range(6, 16),
        ]
        assert np.isinf(dump["worlds/data"][0, :2]).all()
        assert dump["train/params/w"].tolist() == [1.0, 1.0, 1.0]
    assert path.stat().st_mode & 0o777 == 0o644


def test_file_stays_below_its_limit(tmp_path, monkeypatch):
    monkeypatch.setattr(train_dump, "LIMIT_BYTES", 3 * 2**20)
    path = dump_state(tmp_path / "state.npz", carry(40, 2**17))  # 512 KiB a world
    assert path.stat().st_size <= 3 * 2**20
    with np.load(path, allow_pickle=False) as dump:
        assert dump["worlds/index"].tolist() == [2, 5, 0]
