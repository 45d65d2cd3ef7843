"""Compiles an MJCF in a process of its own: `python -I custom_child.py FILE CPU_S`.

Prints one JSON object, {"error": ""} when the model is sound. Hostile models can
exhaust time or memory or crash the compiler; here they take only this process along.
"""

import contextlib
import json
import os
import sys

MEMORY_BYTES = 3 << 30


def _limit(cpu_s: int) -> None:
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    with contextlib.suppress(ImportError, ValueError, OSError):
        import resource

        resource.setrlimit(resource.RLIMIT_CPU, (cpu_s, cpu_s))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))


def _fault(path: str) -> str:
    """Says what is wrong with the model, "" if nothing is."""
    import mujoco
    import numpy as np

    try:
        model = mujoco.MjSpec.from_file(path).compile()
    except (ValueError, RuntimeError, MemoryError, mujoco.FatalError) as error:
        return f"MuJoCo refuses it: {error}"
    for name in dir(model):
        array = getattr(model, name)
        floats = isinstance(array, np.ndarray) and array.dtype.kind == "f"
        if floats and not np.all(np.isfinite(array)):
            return f"{name} is not finite"
    for body in range(1, model.nbody):
        moves = model.body_dofnum[body] > 0
        if model.body_mass[body] < 0 or (moves and model.body_subtreemass[body] <= 0):
            return f"body {model.body(body).name} has mass {model.body_mass[body]:g}"
    return ""


if __name__ == "__main__":
    _limit(int(sys.argv[2]))
    print(json.dumps({"error": _fault(sys.argv[1])}))
