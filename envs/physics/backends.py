"""The physics backends by name: `jax` and `warp` (MJX), `cpu` (C MuJoCo)."""

import jax
import mujoco

from envs.config.settings.backend import BACKENDS as BACKENDS
from envs.errors import InputError, one_of
from envs.physics.base import Physics
from envs.physics.cpu import CpuPhysics
from envs.physics.mjx import MjxPhysics
from envs.physics.quiet_mjx import WARP_INSTALLED


def default_backend() -> str:
    """Returns "warp" where a CUDA device and warp-lang are present, else "cpu"."""
    return "warp" if WARP_INSTALLED and _has_cuda() else "cpu"


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


def _has_cuda() -> bool:
    try:
        return bool(jax.devices("cuda"))
    except RuntimeError:
        return False
