"""Which body carries the load of a joint."""

import numpy as np
from jaxtyping import Int

from envs.physics.quiet_mujoco import mujoco

PAYLOAD = "payload"
"""Name of the body that carries the load, where there is one."""


def carrying_bodies(
    model: mujoco.MjModel, body: Int[np.ndarray, " v"]
) -> Int[np.ndarray, " v"]:
    """Returns for every joint the body that carries its load.

    The body named `payload` where there is one, else the last body of the joint's
    chain.

    Args:
        model: the bodies.
        body: number of the body that each joint moves.

    Source:
        Ours: a load hangs on the end of a chain.
    """
    named = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, PAYLOAD)
    result = []
    for start in body:
        below = [start]
        for i in range(start + 1, model.nbody):
            if model.body_parentid[i] in below:
                below.append(i)
        result.append(named if named in below else below[-1])
    return np.array(result)
