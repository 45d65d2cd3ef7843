"""Engines by name."""

from pathlib import Path

from fingers_mjx.studies.sweep.engines.engine import Engine, local
from fingers_mjx.studies.sweep.engines.population import population
from fingers_mjx.studies.sweep.engines.ray_cluster import ray_cluster
from fingers_mjx.studies.sweep.spec import Sweep


def make_engine(spec: Sweep, root: Path) -> Engine:
    """Returns the engine that a resolved sweep names.

    Args:
        spec: resolved.
        root: directory of the sweep, absolute.

    Raises:
        InputError: the engine is not installed, or its cluster cannot be reached.
    """
    make = {"local": local, "ray": ray_cluster, "population": population}
    return make[spec.engine or "local"](spec, root)
