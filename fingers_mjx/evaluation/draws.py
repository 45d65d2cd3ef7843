"""What the hands of an evaluation differ in, to be looked at beside the measures."""

import numpy as np

from envs.base import State
from envs.memory import Memory

AXES = "xyz"
OF_JOINTS = ("stiffness_scale", "damping_scale")
PREFIX = "world/"


def world_columns(state: State) -> dict[str, np.ndarray]:
    """Returns what the randomization of the hand drew, a column each.

    What a task draws, such as the springs of a keyboard, is not among them.

    Vectors have a column for each axis, "world/palm_com_m_x", and quantities of the
    joints one for each joint in the order of the actions, "world/stiffness_scale_0".

    Args:
        state: of all worlds.

    Returns:
        Columns of one value per world, in units of `envs.randomize.Variation`; none for
        an environment that draws nothing.

    Source:
        Ours.
    """
    if not isinstance(state.memory, Memory):
        return {}
    columns = {}
    for name, drawn in vars(state.memory.world.variation).items():
        values = np.asarray(drawn, float)
        if values.ndim == 1:
            columns[PREFIX + name] = values
            continue
        ends = range(values.shape[1]) if name in OF_JOINTS else AXES
        parts = zip(ends, values.T, strict=True)
        columns |= {f"{PREFIX}{name}_{end}": part for end, part in parts}
    return columns
