import jax
import numpy as np

from envs.streams import stream


def words(key):
    return tuple(np.asarray(jax.random.key_data(key)).tolist())


def test_streams_are_fixed_by_key_and_name():
    """The words are part of what a seed promises: they may never change."""
    key = jax.random.key(0)
    assert words(stream(key, "noise")) == words(stream(key, "noise"))
    assert words(stream(key, "noise")) == (1940769652, 931829846)


def test_streams_differ_between_names_and_keys():
    names = [f"{word}{i}" for word in ("noise", "command", "") for i in range(50)]
    keys = [jax.random.key(seed) for seed in range(3)]
    found = {words(stream(key, name)) for key in keys for name in names}
    assert len(found) == len(names) * len(keys)


def test_streams_work_under_vmap_and_jit():
    keys = jax.random.split(jax.random.key(1), 4)
    batched = jax.jit(jax.vmap(lambda key: stream(key, "x")))(keys)
    assert [words(k) for k in batched] == [words(stream(k, "x")) for k in keys]
