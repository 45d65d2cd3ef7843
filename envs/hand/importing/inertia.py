"""Mass and inertia of the rigid groups of a user's model: palm, payload, links."""

from collections.abc import Iterable
from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Float

from envs.hand.importing.palm import Frame
from envs.hand.model import PAYLOAD

PALM_GROUP, PAYLOAD_GROUP = -1, -2


@dataclass(frozen=True)
class Inertia:
    """Inertial parameters of a group of bodies in the frame of the group.

    Attributes:
        mass: of all bodies [kg].
        pos: centre of mass [m].
        quat: principal axes, w x y z.
        diagonal: moments about them [kg·m²].
    """

    mass: float
    pos: Float[np.ndarray, "3"]
    quat: Float[np.ndarray, "4"]
    diagonal: Float[np.ndarray, "3"]


def groups(
    model: mujoco.MjModel, links: list[int], palm: int, root: int
) -> dict[int, list[int]]:
    """Sorts the bodies of the hand by what they move with.

    Args:
        model: the user's.
        links: bodies of the hinges.
        palm: body that carries the fingers.
        root: topmost body of the hand.

    Returns:
        Bodies by the index of their link, `PALM_GROUP` or `PAYLOAD_GROUP`: a body
        named payload that is fixed to the palm, with what is fixed to it.
    """
    group = dict.fromkeys([root, palm], PALM_GROUP)
    for body in range(1, model.nbody):
        parent = int(model.body_parentid[body])
        if body in links:
            group[body] = links.index(body)
        elif parent in group and body not in group:
            loose = model.body(body).name == PAYLOAD and group[parent] == PALM_GROUP
            group[body] = PAYLOAD_GROUP if loose else group[parent]
    known = (*range(len(links)), PALM_GROUP, PAYLOAD_GROUP)
    found: dict[int, list[int]] = {index: [] for index in known}
    for body, index in group.items():
        found[index].append(body)
    return found


def inertia_of(
    model: mujoco.MjModel, data: mujoco.MjData, bodies: Iterable[int], frame: Frame
) -> Inertia:
    """Adds up the bodies of a group (parallel axes).

    Args:
        model: the user's.
        data: its pose.
        bodies: of the group.
        frame: of the group in the world.
    """
    ids = list(bodies)
    mass, pos = model.body_mass[ids], data.xipos[ids]
    total = float(mass.sum())
    centre = mass @ pos / total if total > 0 else frame.pos
    tensor = np.zeros((3, 3))
    for body, m, place in zip(ids, mass, pos, strict=True):
        axes, away = data.ximat[body].reshape(3, 3), place - centre
        tensor += axes @ np.diag(model.body_inertia[body]) @ axes.T
        tensor += m * (away @ away * np.eye(3) - np.outer(away, away))
    values, vectors = np.linalg.eigh(frame.mat.T @ tensor @ frame.mat)
    # Rounding must not leave a plate with moments that no body has.
    values[2] = min(values[2], (values[0] + values[1]) * (1.0 - 1e-9))
    vectors = vectors * np.sign(np.linalg.det(vectors))
    in_frame = frame.inverse.of(Frame(centre, np.eye(3))).pos
    return Inertia(total, in_frame, Frame(in_frame, vectors).quat, values)
