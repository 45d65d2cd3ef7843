"""On what a result was made, without anything that names the machine."""

import os
import platform


def machine() -> str:
    """Returns cores, architecture and the device that JAX computes on."""
    import jax  # most commands that read runs need none

    device = jax.devices()[0].device_kind
    return f"{os.cpu_count()} cores ({platform.machine()}), JAX on {device}"
