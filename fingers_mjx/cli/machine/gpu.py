"""Says when an NVIDIA GPU is there and what would use it is missing or broken."""

import importlib.util
import logging
import os
import shutil
import sys
from collections.abc import Mapping
from importlib import metadata
from pathlib import Path

from fingers_deploy.errors import shortened
from fingers_mjx.cli.machine.installation import DISTRIBUTION, source_tree

SIGNS = ("dev/nvidia[0-9]*", "usr/lib/wsl/lib/libcuda.so.1")
"""Files that only a visible NVIDIA GPU has, of Linux and of WSL 2."""

EXTRA = "cuda12"
"""The extra of which more drivers and GPUs are capable; `cuda13` needs newer ones."""

MADE = ("cuda12", "cuda13")
"""Extras with a target of the Makefile, which keeps one from the other."""

_CHOICES = ("JAX_PLATFORMS", "JAX_PLATFORM_NAME")
_DEVICES = "CUDA_VISIBLE_DEVICES"
_NONE = ("", "-1", "NoDevFiles")


def idle_gpu(
    backend: str | None = None,
    environment: Mapping[str, str] = os.environ,
    root: Path = Path("/"),
) -> str | None:
    """Returns one sentence about a GPU that stays idle, with the command; else None.

    Nothing of CUDA is imported and no device is opened. What is said of a CUDA JAX that
    is installed and does not start is `failed_cuda`.

    Args:
        backend: physics backend that the user asked for, if any.
        environment: variables of the process, by which the CPU can be chosen.
        root: of the file system.
    """
    if backend == "cpu" or chose_cpu(environment) or not sees_gpu(root):
        return None
    if not has_cuda_jax():
        return (
            f"an NVIDIA GPU is idle, this JAX knows the CPU only ({install_command()})"
        )
    if backend is None and importlib.util.find_spec("warp") is None:
        return f"physics stays on the CPU, Warp is not installed ({install_command()})"
    return None


def failed_cuda(
    said: str,
    environment: Mapping[str, str] = os.environ,
    root: Path = Path("/"),
) -> str | None:
    """Returns one sentence about a GPU whose CUDA plugin of JAX does not start.

    Args:
        said: by JAX of CUDA (`envs.physics.backends.cuda_fault`).
        environment: variables of the process, by which the CPU can be chosen.
        root: of the file system.
    """
    if chose_cpu(environment) or not sees_gpu(root) or not has_cuda_jax():
        return None
    what = "an NVIDIA GPU is idle, JAX cannot start its CUDA plugin"
    return f"{what}: {shortened(said, 200)} (fingers doctor)"


def note_failed_cuda(said: str) -> None:
    """Prints that sentence on stderr where there is one.

    Args:
        said: as in `failed_cuda`.
    """
    if sentence := failed_cuda(said):
        print(f"fingers: {sentence}", file=sys.stderr)


def sees_gpu(root: Path = Path("/")) -> bool:
    """Whether an NVIDIA GPU is visible to this process."""
    return any(any(root.glob(sign)) for sign in SIGNS)


def chose_cpu(environment: Mapping[str, str]) -> bool:
    """Whether the user's variables keep JAX from the GPU."""
    if environment.get(_DEVICES, "all") in _NONE:
        return True
    asked = [name for key in _CHOICES for name in environment.get(key, "").split(",")]
    return any(asked) and not {"cuda", "gpu"} & {name.strip() for name in asked}


def has_cuda_jax() -> bool:
    """Whether JAX's plugin for CUDA is installed."""
    plugins = metadata.entry_points(group="jax_plugins")
    return any("cuda" in plugin.name for plugin in plugins)


def install_command(extra: str = EXTRA) -> str:
    """Returns what adds an extra of ours to the environment that runs.

    An installed package is never looked for elsewhere: pip takes the one that is there
    and adds what the extra needs.
    """
    if source_tree() is None:
        return f'pip install "{DISTRIBUTION}[{extra}]"'
    if extra in MADE:
        return f"make {extra}"
    uv = "uv" if shutil.which("uv") else ".uv/bin/uv"  # as the Makefile looks for it
    return f"{uv} sync --inexact --extra {extra}"


def quiet_jax() -> None:
    """Keeps JAX from saying the same once more, without the command."""
    same = "CUDA-enabled jaxlib is not installed"
    log = logging.getLogger("jax._src.xla_bridge")
    log.addFilter(lambda record: same not in record.getMessage())
