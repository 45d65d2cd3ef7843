"""MuJoCo Warp's kernels compiled beside XLA's program instead of after it."""

import functools
import threading

PACKAGE = "mujoco.mjx.third_party.mujoco_warp._src"
LARGE = (
    "solver",
    "smooth",
    "constraint",
    "derivative",
    "sensor",
    "passive",
    "forward",
    "support",
)
"""Modules that take longest to compile, the slowest first."""
WORKERS = 4


@functools.cache
def compile_ahead() -> threading.Thread:
    """Starts to compile the large modules, once in a process, and does not wait.

    What is not ready when it is first needed, Warp compiles then, as it would have.
    """
    thread = threading.Thread(target=_load, name="warp-kernels", daemon=True)
    thread.start()
    return thread


def _load() -> None:
    import importlib

    import warp as wp  # pyright: ignore[reportMissingImports]

    modules = [importlib.import_module(f"{PACKAGE}.{name}") for name in LARGE]
    found = [wp.get_module(module.__name__) for module in modules]
    wp.force_load(wp.get_preferred_device(), found, max_workers=WORKERS)
