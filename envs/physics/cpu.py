"""C MuJoCo on the threads of the CPU, called from JAX."""

import copy
import math
import threading
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.experimental.buffer_callback import buffer_callback
from jaxtyping import Array, Float
from mujoco.batch import Batch, SimulationError

from envs.errors import InputError
from envs.physics.base import (
    ModelFields,
    PhysicsOutput,
    PhysicsState,
    check_model,
    nan_if_diverged,
    nominal_field,
)
from envs.physics.quiet_mujoco import mujoco

# C MuJoCo skips a frame that coincides with its body's, and MJX does not. So the
# compiler's note that it coincides must go when the frame is given per world.
_SAME_FRAME = {
    "body_ipos": "body_sameframe",
    "body_iquat": "body_sameframe",
    "geom_pos": "geom_sameframe",
    "geom_quat": "geom_sameframe",
    "site_pos": "site_sameframe",
    "site_quat": "site_sameframe",
}
_INERTIAL = {"body_mass", "body_inertia", "body_ipos", "body_iquat"}


class CpuPhysics:
    """`envs.physics.Physics` on C MuJoCo, in float64 between float32 states.

    Args:
        mj_model: the nominal model.
        n_substeps: physics steps per control step.
        threads: threads to step worlds on; 0 is one per core. The results are the
            same bit for bit with any number.
    """

    def __init__(self, mj_model: mujoco.MjModel, n_substeps: int, threads: int = 0):
        check_model(mj_model, n_substeps)
        self.mj_model, self.n_substeps, self.threads = mj_model, n_substeps, threads
        self._worlds: dict[tuple[int, frozenset[str]], _Worlds] = {}
        # A Batch serves one caller at a time; XLA may run two programs at once.
        self._lock = threading.Lock()

    def step(
        self,
        fields: ModelFields,
        state: PhysicsState,
        ctrl: Float[Array, "substeps nu"],
    ) -> PhysicsOutput:
        """One control step of one world: (s, u₁ … u_n; fields) ↦ (s', sensors).

        Under vmap, all worlds are one call of the host.

        Args:
            fields: what differs from the nominal model.
            state: positions [m, rad] and velocities [m/s, rad/s] before.
            ctrl: controls of the substeps [rad].

        Raises:
            InputError: the inertia of a body is given that C MuJoCo fixes when it
                compiles the model.

        Source:
            MuJoCo documentation, Computation.
        """
        _check_fields(self.mj_model, fields)
        model, vector = self.mj_model, jax.ShapeDtypeStruct
        shapes = (
            vector((model.nq,), jnp.float32),
            vector((model.nv,), jnp.float32),
            vector((model.nv,), jnp.float32),
            vector((model.nsensordata,), jnp.float32),
        )
        assert ctrl.shape == (self.n_substeps, model.nu)
        *after, sensordata = _call_host(self._advance, shapes, fields, state, ctrl)
        overflow = jnp.zeros((), jnp.int32)
        return nan_if_diverged(
            PhysicsOutput(PhysicsState(*after), sensordata, overflow)
        )

    def _advance(
        self, fields: dict[str, np.ndarray], state: Any, ctrl: np.ndarray
    ) -> list[np.ndarray]:
        """Steps all worlds; leading axes of the arguments broadcast to the worlds."""
        ranks = {name: nominal_field(self.mj_model, name).ndim for name in fields}
        parts = [(fields[name], rank) for name, rank in ranks.items()]
        parts += [(state.qpos, 1), (state.qvel, 1), (state.qacc_warmstart, 1)]
        parts += [(ctrl, 2)]
        lead = np.broadcast_shapes(*(x.shape[: x.ndim - rank] for x, rank in parts))
        rows = [_rows(x, lead, rank) for x, rank in parts]
        with self._lock:
            worlds = self._worlds_for(math.prod(lead), frozenset(fields))
            worlds.apply(dict(zip(ranks, rows, strict=False)))
            outputs = worlds.run(*rows[len(ranks) :])
            return [x.astype(np.float32).reshape(*lead, *x.shape[1:]) for x in outputs]

    def _worlds_for(self, number: int, names: frozenset[str]) -> "_Worlds":
        key = (number, names)
        if key not in self._worlds:
            self._worlds[key] = _Worlds(self.mj_model, number, names, self.threads)
        return self._worlds[key]


class _Worlds:
    """A `mujoco.batch.Batch` whose every call starts from given states.

    What it remembers between calls is only which model fields it holds.

    `Batch.rollout` takes the controls of all substeps in one call and leaves the last
    sensors in the bound array. With 1024 hands of 26 degrees of freedom and four
    substeps, two idle cores made 12.3 k control steps/s with it, 11.4 k with four calls
    of `Batch.step` (on loaded cores the two are equal), and 10.9 k with
    `mujoco.rollout`, which also needs an `MjModel` per world to vary its masses.
    """

    def __init__(
        self,
        mj_model: mujoco.MjModel,
        number: int,
        names: frozenset[str],
        threads: int,
    ):
        model = copy.copy(mj_model)
        # Otherwise a diverged world starts again at qpos0 as if nothing had happened.
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
        for name in names & _SAME_FRAME.keys():
            getattr(model, _SAME_FRAME[name])[:] = mujoco.mjtSameFrame.mjSAMEFRAME_NONE
        self.batch = Batch(model, number, threads)
        self.fields = {name: self.batch.expand(name) for name in sorted(names)}
        self.applied: dict[str, np.ndarray] = {}
        bind = self.batch.bind
        self.state = [bind(name) for name in ("qpos", "qvel", "qacc_warmstart")]
        self.time, self.sensordata = bind("time"), bind("sensordata")

    def apply(self, fields: dict[str, np.ndarray]) -> None:
        """Writes the model fields that differ from those of the last call."""
        for name, new in fields.items():
            if not _same_bits(new, self.applied.get(name)):
                self.fields[name][:] = new
                self.applied[name] = new.copy()

    def run(
        self,
        qpos: np.ndarray,
        qvel: np.ndarray,
        qacc_warmstart: np.ndarray,
        ctrl: np.ndarray,
    ) -> list[np.ndarray]:
        """Returns qpos, qvel, qacc_warmstart and sensors after one control step."""
        self.time[:] = 0
        self.batch.warning[:] = 0
        for row, value in zip(self.state, (qpos, qvel, qacc_warmstart), strict=True):
            row[:] = value
        try:
            self.batch.rollout(ctrl.shape[1], control=ctrl, record=())
            failed = np.zeros(len(ctrl), bool)
        except SimulationError:  # the other worlds have run to their end
            failed = self.batch.status != 0
        # A rollout breaks off at a warning: bad state, bad control, no memory.
        failed |= self.batch.warning[:, :, 1].any(axis=1)
        outputs = [*self.state, self.sensordata]
        if failed.any():
            outputs = [np.where(failed[:, None], np.nan, x) for x in outputs]
        return outputs


def _same_bits(new: np.ndarray, old: np.ndarray | None) -> bool:
    integer = f"i{new.itemsize}"
    return old is not None and np.array_equal(new.view(integer), old.view(integer))


def _rows(x: np.ndarray, lead: tuple[int, ...], rank: int) -> np.ndarray:
    """Returns `x` with one leading axis over all worlds in place of several or none."""
    own = x.shape[x.ndim - rank :]
    return np.broadcast_to(x, (*lead, *own)).reshape(math.prod(lead), *own)


def _check_fields(mj_model: mujoco.MjModel, fields: ModelFields) -> None:
    # The inertia of a single free body is a constant that its compiler works out.
    if mj_model.dof_simplenum.any() and (given := _INERTIAL & fields.keys()):
        valid = "a model without loose bodies, for which it would not count"
        raise InputError("physics fields", min(given), "a value per world", valid)


def _call_host(function: Any, shapes: Any, *args: Any) -> Any:
    """Calls `function(*args)` with NumPy arrays, once for all worlds of a vmap.

    On the CPU, `jax.pure_callback` copies arguments by a task for the thread pool in
    which the calling program itself occupies a thread: with one core, and from some
    hundred worlds on, it waits for ever. `buffer_callback` hands over the memory as it
    is, but only on the CPU; from a GPU it must be `pure_callback`, which has no such
    trouble there, the caller not being in that pool.
    """

    def with_numpy(*given: Any) -> Any:
        return function(*jax.tree.map(np.asarray, given))

    def into(_context: Any, out: Any, *given: Any) -> None:
        for buffer, value in zip(out, with_numpy(*given), strict=True):
            np.asarray(buffer)[...] = value

    if jax.default_backend() == "cpu":
        return buffer_callback(into, shapes, vmap_method="expand_dims")(*args)
    return jax.pure_callback(
        lambda *given: tuple(with_numpy(*given)),
        shapes,
        *args,
        vmap_method="expand_dims",
    )
