"""JAX before it computes anything: rounding, and what it prints."""

import importlib
import warnings


def prepare_jax() -> None:
    """Sets what must be set before JAX computes anything, and imports it quietly."""
    from envs.rounding import fix_rounding

    fix_rounding()
    # JAX warns of every child process; ours (git, ffmpeg) are replaced at once.
    warnings.filterwarnings("ignore", "os.fork", RuntimeWarning)
    importlib.import_module("envs.physics.quiet_mjx")
