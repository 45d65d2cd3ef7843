"""Bare physics: native batch stepping of the same hand, with nothing of ours around it.

Every world begins in the stance. Its joint targets are held, or move as they do under
small random actions: a hand at rest needs one iteration of the contact solver, hands
that move need several, and on a GPU all worlds wait for the slowest.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from jaxtyping import Float

from envs.env import HandEnv

STEPS = 20
"""Control steps of a call, as of the layers above."""


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


def joint_targets(
    env: HandEnv, worlds: int, action_std: float
) -> Float[np.ndarray, "steps b joints"]:
    """Targets of `STEPS` control steps under random actions, θ ← θ + α tanh(a) [rad].

    Args:
        env: of whose hand.
        worlds: how many.
        action_std: standard deviation of a ~ N(0, σ²) [1]; zero holds the stance.

    Source:
        `envs.plant.Plant.next_target`.
    """
    actions = action_std * jax.random.normal(
        jax.random.key(1), (STEPS, worlds, env.action_size)
    )
    start = jnp.tile(jnp.array(env.stance.target_rad), (worlds, 1))

    def move(target: Any, action: Any) -> tuple[Any, Any]:
        move_one = jax.vmap(env.plant.next_target, in_axes=(0, 0, None))
        after = move_one(target, action, env.config.action_scale_rad)
        return after, after

    return np.asarray(jax.lax.scan(move, start, actions)[1])


def bare_cpu(env: HandEnv, worlds: int, action_std: float = 0.0) -> Layer:
    """C MuJoCo's own thread pool over all cores, `mujoco.batch.Batch`."""
    batch = mujoco.batch.Batch(env.mj_model, worlds)
    substeps = env.plant.n_substeps
    targets = joint_targets(env, worlds, action_std)
    ctrl = [np.repeat(x[:, None], substeps, axis=1).astype(float) for x in targets]

    def call() -> None:
        batch.qpos, batch.qvel = env.stance.qpos, 0.0
        for control in ctrl:
            batch.rollout(substeps, control=control, record=())

    return Layer(call, STEPS)


def bare_warp(env: HandEnv, worlds: int, action_std: float = 0.0) -> Layer:
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
    targets = wp.array(joint_targets(env, worlds, action_std), dtype=float)
    qpos = wp.array(np.tile(env.stance.qpos, (worlds, 1)), dtype=float)

    def call() -> None:
        wp.copy(data.qpos, qpos)
        data.qvel.zero_()
        for k in range(STEPS):
            wp.copy(data.ctrl, targets[k])
            for _ in range(env.plant.n_substeps):
                step()
        wp.synchronize()

    call()
    used = data.solver_niter.numpy()
    note += f"; last step: {used.mean():.1f} solver iterations, at most {used.max()}"
    return Layer(call, STEPS, note)


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
