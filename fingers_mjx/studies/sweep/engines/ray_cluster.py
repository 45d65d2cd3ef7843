"""The engine `ray`: members as processes on the nodes of a Ray cluster.

The nodes share the directory of the sweep and have this package installed.
"""

import importlib
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from envs.errors import InputError
from fingers_mjx.studies.sweep.engines.engine import Engine, one_by_one, worker_words
from fingers_mjx.studies.sweep.engines.process import (
    WORKER,
    Process,
    worker_environment,
)
from fingers_mjx.studies.sweep.plan import Key
from fingers_mjx.studies.sweep.spec import Sweep

LOST = 1
"""Exit status of a worker whose node is gone."""
LOOPBACK = "127.0.0.2"
"""In the place of 127.0.0.1 Ray takes an address that other machines can reach."""
_OWN = {
    "_node_ip_address": LOOPBACK,
    "include_dashboard": False,
    "object_store_memory": 2**27,
}
_QUIET = {
    "RAY_USAGE_STATS_ENABLED": "0",  # nothing is reported to anybody
    "RAY_ENABLE_UV_RUN_RUNTIME_ENV": "0",  # no copy of the tree to the nodes
}


def ray_cluster(spec: Sweep, root: Path, command: Sequence[str] = WORKER) -> Engine:
    """Returns the engine that trains each member in a process of a Ray cluster.

    Args:
        spec: resolved; `address` names the cluster, without it there is one of our
            own on this machine, reached by loopback alone.
        root: directory of the sweep, absolute, the same on all nodes.
        command: of a worker.

    Raises:
        InputError: Ray is not installed, or there is no cluster at the address.
    """
    ray = _connected(spec.address)
    threads = spec.threads or 1
    gpus = 1 if spec.backend == "warp" else 0
    wanted = {"num_cpus": threads, "num_gpus": gpus, "max_restarts": 0}
    remote = ray.remote(Process).options(**wanted)

    def launch(keys: Sequence[Key]) -> RayJob:
        words, log = worker_words(command, root, keys)
        environment = worker_environment(spec.threads, spec.backend)
        actor = remote.remote(words, log, environment, spec.threads, gpus > 0)
        return RayJob(ray, actor, log)

    slots = spec.processes or _slots(ray.cluster_resources(), threads, gpus)
    return Engine(slots, one_by_one, launch, ray.shutdown)


class RayJob:
    """A worker on some node: the actor there holds its process.

    Args:
        ray: the module.
        actor: made of `Process`.
        log: of the worker, in which a lost node is noted.
    """

    def __init__(self, ray: Any, actor: Any, log: Path):
        self._ray, self._actor, self._log = ray, actor, log
        self._asked = actor.poll.remote()

    def poll(self) -> int | None:
        """Returns the exit status, negative for a signal, or None while it runs."""
        if not self._ray.wait([self._asked], timeout=0)[0]:
            return None
        try:
            status = self._ray.get(self._asked)
        except self._ray.exceptions.RayError as error:
            with self._log.open("a", encoding="utf-8") as log:
                print(" ".join(f"lost: {error}".split()), file=log)
            return LOST
        if status is None:
            self._asked = self._actor.poll.remote()
        else:
            self._ray.kill(self._actor)
        return status

    def stop(self) -> None:
        """Asks it to save and end."""
        self._actor.stop.remote()


def _connected(address: str | None) -> Any:
    """Returns the module of Ray, connected to a cluster."""
    for name, value in _QUIET.items():
        os.environ.setdefault(name, value)
    try:
        ray = importlib.import_module("ray")
    except ModuleNotFoundError as error:
        valid = "local or population, or the extra ray (fingers doctor says how)"
        raise InputError("sweep", "engine", "ray, not installed", valid) from error
    try:
        ray.init(
            address=address or "local",
            log_to_driver=False,
            configure_logging=False,
            **({} if address else _OWN),
        )
    except (ConnectionError, ValueError, RuntimeError) as error:
        valid = "the address of a running Ray cluster"
        raise InputError("sweep", "address", f"{address}: {error}", valid) from error
    return ray


def _slots(resources: dict[str, float], threads: int, gpus: int) -> int:
    """Returns how many workers a cluster has room for."""
    slots = resources.get("CPU", 1.0) // threads
    if gpus:
        slots = min(slots, resources.get("GPU", 0.0))
    return max(1, int(slots))
