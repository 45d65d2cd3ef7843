"""Persistent cache of compiled programs, on unless the user says otherwise."""

import hashlib
import os
import platform
from pathlib import Path

import jax

SWITCH = "FINGERS_COMPILE_CACHE"
"""Environment variable: a directory, or "off"."""


def use_compile_cache() -> Path | None:
    """Turns the cache on and returns its directory; None if it is off.

    A directory that JAX was already given (`JAX_COMPILATION_CACHE_DIR`) is kept.
    """
    choice = os.environ.get(SWITCH, "")
    if choice == "off":
        return None
    given = jax.config.jax_compilation_cache_dir  # pyright: ignore
    directory = Path(choice or given or default_dir())
    jax.config.update("jax_compilation_cache_dir", str(directory))
    return directory


def default_dir() -> Path:
    """Returns the place for the cache among the user's other caches.

    Each kind of processor has its own, since a home directory may be shared between
    machines and a program compiled for one need not run on another.
    """
    home = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(home) / "fingers_mjx" / f"jax-{_processor()}"


def _processor() -> str:
    """Returns a short name for the instruction set of this machine."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8").splitlines() if info.exists() else []
    flags = [line for line in lines if line.startswith(("flags", "Features"))][:1]
    text = " ".join([platform.machine(), *flags])
    return hashlib.sha256(text.encode()).hexdigest()[:12]
