"""The names of the physics backends."""

BACKENDS = ("cpu", "jax", "warp")
