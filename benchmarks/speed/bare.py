"""Bare physics: native batch stepping of the same hand, with nothing of ours around it.

Every world stands in the stance with its joint targets held.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import mujoco
import numpy as np

from envs.env import HandEnv


@dataclass(frozen=True)
class Layer:
    """What is timed.

    Attributes:
        call: does some control steps in every world and waits for them.
        steps: how many.
        note: what a reader of the number must know.
    """

    call: Callable[[], None]
    steps: int
    note: str = ""


def bare_cpu(env: HandEnv, worlds: int) -> Layer:
    """C MuJoCo's own thread pool over all cores, `mujoco.batch.Batch`."""
    batch = mujoco.batch.Batch(env.mj_model, worlds)
    batch.qpos = env.stance.qpos
    substeps, steps = env.plant.n_substeps, 20
    held = (worlds, substeps, env.mj_model.nu)
    ctrl = np.broadcast_to(np.array(env.stance.target_rad), held).copy()

    def call() -> None:
        for _ in range(steps):
            batch.rollout(substeps, control=ctrl, record=())

    return Layer(call, steps)


def bare_warp(env: HandEnv, worlds: int) -> Layer:
    """MuJoCo Warp without JAX, replaying a CUDA graph of one physics step.

    One step and not four: memory that a step allocates while it is recorded is not
    reused by the next step in the same graph.
    """
    import warp as wp  # pyright: ignore[reportMissingImports]
    from mujoco.mjx.third_party import mujoco_warp as mjw

    stance = mujoco.MjData(env.mj_model)
    stance.qpos[:], stance.ctrl[:] = env.stance.qpos, env.stance.target_rad
    mujoco.mj_forward(env.mj_model, stance)
    model = mjw.put_model(env.mj_model)
    # The buffers that the environment's physics has by default.
    data = mjw.put_data(
        env.mj_model, stance, nworld=worlds, naconmax=48 * worlds, njmax=128
    )
    for _ in range(2):  # loads every kernel, which must not happen while recording
        mjw.step(model, data)
    wp.synchronize()
    step, note = _recorded(lambda: mjw.step(model, data), model)
    repeat = 50

    def call() -> None:
        for _ in range(repeat * env.plant.n_substeps):
            step()
        wp.synchronize()

    return Layer(call, repeat, note)


def _replay(graph: Any, kept: object) -> None:
    import warp as wp  # pyright: ignore[reportMissingImports]

    del kept
    wp.capture_launch(graph)


def _recorded(step: Callable[[], None], model: Any) -> tuple[Callable[[], None], str]:
    """Returns the fastest way to repeat `step` that works here, and which one it is.

    Tried in this order: a graph whose solver loop ends when all worlds have converged,
    a graph with the full number of solver iterations, and launches without a graph.
    """
    import warp as wp  # pyright: ignore[reportMissingImports]

    failures = ""
    for conditional in (True, False):
        model.opt.graph_conditional = conditional
        kind = "CUDA graph" if conditional else "CUDA graph, solver loop unrolled"
        try:
            with wp.ScopedCapture() as capture:
                step()
            wp.capture_launch(capture.graph)
            wp.synchronize()
        except RuntimeError as error:
            failures += f"; no {kind}: {' '.join(str(error).split())}"
        else:
            # The graph does not keep the buffers alive that it works on; `step` does.
            return partial(_replay, capture.graph, step), kind + failures
    model.opt.graph_conditional = True
    return step, "kernels launched one by one" + failures
