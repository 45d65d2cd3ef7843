"""Where a comparison is made: folders, device, packages, variables of the workers."""

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from benchmarks.comparison.plan import Job, Worker

CACHES = ("JAX_COMPILATION_CACHE_DIR", "FINGERS_COMPILE_CACHE")
"""Where compiled programs would be found again; a start is measured without."""
FRESH = ("WARP_CACHE_PATH", "CUDA_CACHE_PATH")
"""Folders that a start gets empty: programs are kept there without being asked."""


@dataclass(frozen=True)
class Place:
    """Where a comparison keeps its things.

    Attributes:
        out: folder of rows, model and environments.
        device: `cpu` or `gpu`.
        here: nothing where each peer has an environment of its own. Else peers are
            taken from this very environment, some with folders of packages that are
            searched first (`PYTHONPATH`), by the peer's name.
        starts: of each worker whose start is measured, at most.
        limit_s: of a worker, until it is ready or to answer a question.
    """

    out: Path
    device: str
    here: Mapping[str, str] | None = None
    starts: int = 3
    limit_s: float = float("inf")

    @property
    def mjcf(self) -> Path:
        """The standing hand that peers are given."""
        return self.out / "hand.xml"

    def log(self, job: Job, worker: Worker) -> Path:
        """Returns the file of all that a worker says on its error stream."""
        peer = re.sub(r"[^A-Za-z0-9]+", "-", worker.peer).strip("-")
        return self.out / "logs" / f"{job.name}-{peer}.txt"

    def environment(self, worker: Worker) -> dict[str, str]:
        """Returns the variables of a worker's process."""
        given = {name: x for name, x in os.environ.items() if name not in CACHES}
        # Peers share the GPU's memory while they take turns, and none draws.
        given |= {"XLA_PYTHON_CLIENT_PREALLOCATE": "false", "MUJOCO_GL": "disable"}
        given |= {"WANDB_MODE": "disabled"}
        if first := (self.here or {}).get(worker.environment):
            rest = given.get("PYTHONPATH")
            given["PYTHONPATH"] = os.pathsep.join([first, rest] if rest else [first])
        return given | ({"CUDA_VISIBLE_DEVICES": ""} if self.device == "cpu" else {})
