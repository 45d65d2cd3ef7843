"""State as named arrays on the host, and back."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from envs.errors import InputError


def leaf_names(tree: Any) -> list[str]:
    """Returns the path of every leaf of `tree`, as "train/params/policy/…"."""
    paths = [path for path, _ in jax.tree_util.tree_leaves_with_path(tree)]
    return [jax.tree_util.keystr(p, simple=True, separator="/") for p in paths]


def to_host(tree: Any) -> dict[str, np.ndarray]:
    """Returns the leaves of `tree` by name; typed random keys as their raw data."""
    raw = [_raw_key(leaf) for leaf in jax.tree.leaves(tree)]
    values = jax.device_get(raw)
    pairs = zip(leaf_names(tree), values, strict=True)
    return {name: np.asarray(value) for name, value in pairs}


def describe(tree: Any) -> dict[str, str]:
    """Returns what each leaf is, as "f32[8,20]" or, for keys, "key<fry>[8]"."""
    leaves = [jnp.asarray(x) if np.isscalar(x) else x for x in jax.tree.leaves(tree)]
    kinds = [f"{x.dtype}{list(x.shape)}".replace(" ", "") for x in leaves]
    return dict(zip(leaf_names(tree), kinds, strict=True))


def check_layout(source: Path, saved: Mapping[str, str], template: Any) -> None:
    """Raises InputError if the leaves `saved` in `source` do not fit `template`.

    Raises:
        InputError: naming the first leaf that is missing, extra or of another shape.
    """
    current = describe(template)
    for name in sorted(saved.keys() | current.keys()):
        here, there = current.get(name, "nothing"), saved.get(name, "nothing")
        if here != there:
            raise InputError(source, name, there, f"{here}, as this configuration has")


def from_host(template: Any, arrays: Mapping[str, np.ndarray]) -> Any:
    """Returns `arrays` in the structure and types of `template`, on the device."""
    leaves, structure = jax.tree.flatten(template)
    pairs = zip(leaf_names(template), leaves, strict=True)
    return structure.unflatten([_put(arrays[name], leaf) for name, leaf in pairs])


def _is_key(leaf: Any) -> bool:
    """Whether `leaf` is an array of typed random keys."""
    dtype = getattr(leaf, "dtype", None)
    return dtype is not None and jnp.issubdtype(dtype, jax.dtypes.prng_key)


def _raw_key(leaf: Any) -> Any:
    """Returns the raw data of a typed random key, and anything else as it is."""
    return jax.random.key_data(leaf) if _is_key(leaf) else leaf


def _put(value: np.ndarray, like: Any) -> jax.Array:
    """Returns `value` on the device, as a typed key if `like` is one."""
    if not _is_key(like):
        return jnp.asarray(value, dtype=like.dtype)
    impl = str(like.dtype._impl.name)
    return jax.random.wrap_key_data(jnp.asarray(value), impl=impl)
