"""The task's inputs in the closed loop, as the shim works them out on the robot."""

from typing import Any

import jax
import numpy as np
from jaxtyping import Float

from envs.batch import BatchEnv
from envs.memory import Memory
from envs.observations import Sample
from envs.tasks.push.camera import read_camera
from envs.tasks.push.scene import HALF_M
from envs.tasks.push.task import PushMemory
from fingers_robot.behaviour.tracking import Frame, ObjectTracker


class PlayInputs:
    """Inputs of one episode after another.

    What an operator gives is taken from the memory; what a camera measures goes through
    the shim's own tracker.

    Args:
        env: worlds of the task.
    """

    def __init__(self, env: BatchEnv):
        self._env = env
        self._tracker: ObjectTracker | None = None

    def begin(self, memory: Memory) -> None:
        """Begins an episode: a tracked object has another target."""
        if isinstance(memory.task, PushMemory):
            target_w = np.append(np.asarray(memory.task.target_w), HALF_M)
            self._tracker = ObjectTracker(target_w, self._env.stance.q_off)

    def read(self, memory: Memory, sensed: Sample) -> Float[np.ndarray, " inputs"]:
        """Returns the inputs of a control step, term after term.

        Args:
            memory: before the step.
            sensed: what the sensors measure.
        """
        if self._tracker is None:
            terms = self._env.input_terms
            return np.concatenate([np.asarray(sensed.inputs[t.name]) for t in terms])
        self._tracker.update(_frame(memory.task))
        return self._tracker.inputs(np.asarray(sensed.gravity))


def _frame(task: PushMemory) -> Frame:
    """Returns the sample that the simulated camera delivers."""
    frame: Any = jax.device_get(read_camera(task.camera))
    return Frame(
        float(frame.t_s), frame.object_pos_w, frame.root_pos_w, float(frame.heading_rad)
    )
