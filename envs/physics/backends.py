"""The physics backends by name: `jax` and `warp` (MJX), `cpu` (C MuJoCo)."""

import logging
from collections.abc import Callable

import jax
import mujoco

from envs.config.settings.backend import BACKENDS as BACKENDS
from envs.errors import InputError, one_of
from envs.physics.base import Physics
from envs.physics.cpu import CpuPhysics
from envs.physics.mjx import MjxPhysics
from envs.physics.quiet_mjx import WARP_INSTALLED


def default_backend(on_fault: Callable[[str], object] = lambda said: None) -> str:
    """Returns "warp" where a CUDA device and warp-lang are present, else "cpu".

    Args:
        on_fault: called with what JAX says where warp-lang is there and no CUDA device.
    """
    if not WARP_INSTALLED:
        return "cpu"
    said = cuda_fault()
    if said is None:
        return "warp"
    on_fault(said)
    return "cpu"


def cuda_fault() -> str | None:
    """Returns what JAX says where it has no CUDA device; None where it has one.

    A plugin that does not start is an error where JAX first looks for devices, or an
    exception that it logs there; later it says less, and takes the CPU.
    """
    logged, log = _Exceptions(), logging.getLogger("jax")
    log.addHandler(logged)
    try:
        return None if jax.devices("cuda") else "no device"
    except RuntimeError as error:
        return logged.found[0] if logged.found else _sentence(error)
    finally:
        log.removeHandler(logged)


def make_physics(
    backend: str,
    mj_model: mujoco.MjModel,
    n_substeps: int,
    num_worlds: int,
    *,
    contacts_per_world: int = 48,
    constraints_per_world: int = 128,
) -> Physics:
    """Makes a physics backend.

    Args:
        backend: one of `BACKENDS`.
        mj_model: the nominal model.
        n_substeps: physics steps per control step.
        num_worlds: most worlds that are stepped together (sizes Warp's contact pool).
        contacts_per_world: see `MjxPhysics`; too few show in `PhysicsOutput.overflow`.
        constraints_per_world: see `MjxPhysics`.

    Raises:
        InputError: unknown backend, or a model that the backend cannot step.
    """
    if backend == "cpu":
        return CpuPhysics(mj_model, n_substeps)
    if backend == "jax":
        return MjxPhysics(mj_model, n_substeps, "jax")
    if backend == "warp":
        return MjxPhysics(
            mj_model,
            n_substeps,
            "warp",
            num_worlds=num_worlds,
            contacts_per_world=contacts_per_world,
            constraints_per_world=constraints_per_world,
        )
    raise InputError("physics", "backend", backend, one_of(BACKENDS, backend))


class _Exceptions(logging.Handler):
    """Keeps the exceptions that are logged."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        """Takes a record."""
        error = record.exc_info[1] if record.exc_info else None
        if error is not None:
            self.found.append(_sentence(error))


def _sentence(error: BaseException) -> str:
    """Returns what an exception says on one line."""
    return " ".join(str(error).split()) or type(error).__name__
