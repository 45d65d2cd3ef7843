"""Worlds that MuJoCo Warp holds in memory of its own, and their control step."""

import functools
import math
import threading
from collections.abc import Callable
from typing import Any

import mujoco

from envs.physics.warp_layout import Part, Sizes


@functools.cache
def worlds_of(sizes: Sizes, device: str) -> "_Worlds":
    """Returns the worlds of these sizes on a device of Warp, made when first needed.

    They are kept to the end of the process: a compiled program that steps them may
    outlive the environment for which it was compiled.
    """
    return _Worlds(sizes, device)


class _Worlds:
    """Model and Data of Warp over one buffer that is laid out as `Sizes` says.

    What it remembers between calls is the memory; each control step starts from a Data
    that is as good as new.
    """

    def __init__(self, sizes: Sizes, device: str):
        import warp as wp  # pyright: ignore[reportMissingImports]
        from mujoco.mjx.third_party import mujoco_warp as mjw

        self.sizes, self.device, self.wp, self.mjw = sizes, device, wp, mjw
        self.buffer = wp.zeros(sizes.length, dtype=float, device=device)
        self.model = _put_model(sizes.mj_model)
        self.data = mjw.make_data(
            sizes.mj_model,
            nworld=sizes.worlds,
            naconmax=sizes.naconmax,
            njmax=sizes.njmax,
        )
        for name, _ in sizes.fields:
            *options, last = name.split(".")
            owner = functools.reduce(getattr, options, self.model)
            setattr(owner, last, self._view(sizes.given[name], getattr(owner, last)))
        for name, part in sizes.result.items():
            setattr(self.data, name, self._view(part, getattr(self.data, name)))
        self.ctrl = self.buffer[: sizes.given["ctrl"].room]
        # XLA may run two programs at once.
        self._lock = threading.Lock()
        self._begin: Callable[[], None] = self._as_new
        self._blind: Callable[[], None] = functools.partial(self._step, False)
        self._seeing: Callable[[], None] = functools.partial(self._step, True)
        self._recorded = False

    def advance(self, given: Any, result: Any, overflow: Any) -> None:
        """Does one control step, from one buffer of JAX's into two others.

        Args:
            given: floats as in `Sizes.given`.
            result: floats as in `Sizes.result`.
            overflow: for each world bits of `OverflowType`, of any substep.
        """
        copy, sizes = self.wp.copy, self.sizes
        with self._lock:
            copy(self.buffer, given, count=given.size)
            self._begin()
            size = sizes.worlds * sizes.mj_model.nu
            for k in range(sizes.substeps):
                copy(self.data.ctrl, self.ctrl, src_offset=k * size, count=size)
                (self._seeing if k == sizes.substeps - 1 else self._blind)()
            copy(result, self.buffer, src_offset=sizes.result_start, count=result.size)
            copy(overflow, self.data.overflow)
            if not self._recorded:
                self._record()

    def _view(self, part: Part, like: Any) -> Any:
        """Returns a part of the buffer as an array of Warp's type for it."""
        shape = (self.sizes.worlds, *like.shape[1:])
        pointer = self.buffer.ptr + 4 * part.start
        assert self.wp.types.type_size_in_bytes(like.dtype) * math.prod(shape) == (
            4 * math.prod(part.shape)
        )
        return self.wp.array(
            ptr=pointer, dtype=like.dtype, shape=shape, device=self.device
        )

    def _as_new(self) -> None:
        """Makes Data what `make_data` returns, where a step reads it before writing.

        Rows of constraints beyond those in use are multiplied by zero in the solver,
        which does not undo what is not a number: a world that diverged would stay so.
        """
        data = self.data
        for array in (data.time, data.overflow, data.efc.J, data.efc.D):
            array.zero_()

    def _step(self, sensors: bool) -> None:
        """Does one physics step; only the sensors of the last one are ever read."""
        flags = self.model.opt.disableflags
        if not sensors:
            self.model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_SENSOR
        self.mjw.step(self.model, self.data)
        self.model.opt.disableflags = flags

    def _record(self) -> None:
        """Records graphs of what has just run, and which therefore is loaded.

        One physics step a graph: memory that a step allocates while it is recorded is
        not reused by the next step in the same graph.
        """
        self._begin = self._graph(self._begin)
        self._seeing = self._graph(self._seeing)
        if self.sizes.substeps > 1:
            self._blind = self._graph(self._blind)
        self._recorded = True

    def _graph(self, run: Callable[[], None]) -> Callable[[], None]:
        with self.wp.ScopedCapture() as capture:
            run()
        # Kept whole: it holds the modules that the graph runs.
        return lambda: self.wp.capture_launch(capture.graph)


def _put_model(mj_model: mujoco.MjModel) -> Any:
    """Returns Warp's model with the options that `mjx.put_model` gives it."""
    import warp as wp  # pyright: ignore[reportMissingImports]
    from mujoco.mjx.third_party import mujoco_warp as mjw

    model = mjw.put_model(mj_model)
    # Warp by itself raises the tolerance to 1e-6.
    model.opt.tolerance = wp.array([mj_model.opt.tolerance], dtype=float)
    # The environment counts overflows and reports them; printed from within the GPU
    # it would be up to a line for each world and physics step.
    model.opt.warn_overflow = 0
    # Loops of the solver that end when all worlds have converged, from CUDA 12.4 on.
    model.opt.graph_conditional = wp.is_conditional_graph_supported()
    return model
