"""What passes between JAX and MuJoCo Warp: where each array is in one buffer of floats.

    controls | model fields | qpos | qvel | qacc_warmstart | sensordata

JAX gives what is left of the sensors and gets the state and what is right of it. The
state stays in its place: Warp steps it there.
"""

import functools
import math
from dataclasses import dataclass, field

import mujoco

ALIGNED = 64
"""Floats to which a part of the buffer is aligned: 256 bytes, as CUDA allocates."""


@dataclass(frozen=True)
class Part:
    """A part of the buffer that JAX fills and reads.

    Attributes:
        start: index of its first float.
        shape: its shape in JAX.
    """

    start: int
    shape: tuple[int, ...]

    @property
    def room(self) -> int:
        """Floats of the part and of what aligns the next one."""
        return -(-math.prod(self.shape) // ALIGNED) * ALIGNED


@dataclass(frozen=True)
class Sizes:
    """What the memory is made for; equal sizes share it.

    Attributes:
        digest: stands for the contents of `mj_model`.
        worlds: how many.
        substeps: physics steps of a control step.
        fields: names of the model's fields that each world has its own of, and the
            shapes of one world's.
        naconmax: contacts of all worlds together.
        njmax: constraint rows of one world.
        mj_model: the nominal model.
    """

    digest: bytes
    worlds: int
    substeps: int
    fields: tuple[tuple[str, tuple[int, ...]], ...]
    naconmax: int
    njmax: int
    mj_model: mujoco.MjModel = field(compare=False, repr=False)

    @functools.cached_property
    def given(self) -> dict[str, Part]:
        """What comes from JAX: controls, model fields and, last, the state."""
        model = self.mj_model
        shapes = {"ctrl": (self.substeps, self.worlds, model.nu)}
        shapes |= {name: (self.worlds, *shape) for name, shape in self.fields}
        return _laid_out(0, shapes | self._state)

    @functools.cached_property
    def result(self) -> dict[str, Part]:
        """What goes back: the state, in its place in `given`, and the sensors."""
        shapes = {"sensordata": (self.worlds, self.mj_model.nsensordata)}
        return _laid_out(self.given["qpos"].start, self._state | shapes)

    @property
    def result_start(self) -> int:
        """Where the result begins in the buffer."""
        return self.result["qpos"].start

    @property
    def length(self) -> int:
        """Floats of the whole buffer."""
        last = self.result["sensordata"]
        return last.start + last.room

    @property
    def _state(self) -> dict[str, tuple[int, ...]]:
        model, worlds = self.mj_model, self.worlds
        sizes = {"qpos": model.nq, "qvel": model.nv, "qacc_warmstart": model.nv}
        return {name: (worlds, size) for name, size in sizes.items()}


def _laid_out(start: int, shapes: dict[str, tuple[int, ...]]) -> dict[str, Part]:
    parts = {}
    for name, shape in shapes.items():
        parts[name] = Part(start, shape)
        start += parts[name].room
    return parts
