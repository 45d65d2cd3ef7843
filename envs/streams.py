"""Named random streams: adding one draw moves no other."""

import zlib

import jax
from jaxtyping import Array


def stream(key: Array, name: str) -> Array:
    """Returns the key of the stream `name` of `key`."""
    return jax.random.fold_in(key, zlib.crc32(name.encode()) & 0x7FFFFFFF)
