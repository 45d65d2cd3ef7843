"""The whole policy side of the control loop: measurements in, joint targets out."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fingers_deploy.action import ActionTransform
from fingers_deploy.bundle import Bundle, check_joint_order
from fingers_deploy.observation import History, ObservationAssembler
from fingers_deploy.policy import Runtime, load_policy

Array = NDArray[np.float32]


class PolicyController:
    """Runs a policy at the control rate of its manifest.

    A non-finite measurement or policy output changes nothing: the last target is held,
    `fault` says why and `faults` counts how many steps in a row. Whether to go on is
    for the caller.

    Args:
        bundle: a verified bundle.
        runtime: "onnxruntime", "numpy", or "auto" for the first that is installed.
    """

    def __init__(self, bundle: Bundle, runtime: Runtime = "auto"):
        self.bundle = bundle
        self._policy = load_policy(bundle, runtime)
        self.assembler = ObservationAssembler(bundle.manifest.interface)
        self._transform = ActionTransform(bundle.manifest.interface)
        self.reset()

    def check_joint_order(self, names: Sequence[str]) -> None:
        """Refuses a hand whose joints are not those of the policy, in its order.

        Raises:
            BundleError: naming the first joint that differs.
        """
        check_joint_order(self.bundle, list(names))

    def reset(self, target_rad: ArrayLike | None = None) -> None:
        """Starts an episode; the next sample fills the whole history.

        Args:
            target_rad: targets to go on from, e.g. the measured pose [rad], [n]; the
                initial target of the training when left out. a_{t−1} = 0.

        Raises:
            ValueError: targets of another shape or not finite.

        Source:
            Ours: an episode of training begins so (`docs/reference/crawl.md`).
        """
        initial = self.bundle.manifest.interface.initial_target_rad
        self.action: Array = np.zeros(len(initial), np.float32)
        chosen = initial if target_rad is None else target_rad
        # A zero action leaves a target where it is, but for shape and limits.
        self.target_rad: Array = self._transform.step(chosen, self.action)
        self.observation: Array | None = None
        self.fault = ""
        self.faults = 0
        self._history: History | None = None

    def resume(
        self, history: History | None, action: ArrayLike, target_rad: ArrayLike
    ) -> None:
        """Goes on from a history, e.g. of another policy (`behaviour.hand_over`).

        Args:
            history: observation history up to the last control step.
            action: clipped policy output a_{t−1} = clip(a, ±c) of that step [1], [n].
            target_rad: targets on the wire [rad], [n].

        Raises:
            ValueError: targets of another shape or not finite.

        Source:
            Ours: what one policy measured, another would have measured as well.
        """
        self.reset(target_rad)
        self._history = history
        self.action = self._transform.clip_action(action)

    def step(
        self,
        joint_pos: ArrayLike,
        gravity_b: ArrayLike,
        angvel_b: ArrayLike,
        command: ArrayLike,
    ) -> Array:
        """Returns the joint targets [rad] of this control step, [n].

        target ← clip(target + α·tanh(π(o))), with the policy π and the observation o of
        `ObservationAssembler`.

        Args:
            joint_pos: measured joint angles [rad], in the manifest's joint order, [n].
            gravity_b: unit vector of gravity (points down) in the palm frame, [3].
            angvel_b: angular velocity of the palm in the palm frame [rad/s], [3].
            command: task inputs as the manifest describes them, crawl: [3].

        Raises:
            ValueError: an argument of another shape.

        Source:
            Ours: the control step of training (`docs/reference/crawl.md`).
        """
        sample = self.assembler.sample(
            joint_pos, gravity_b, angvel_b, self.action, command
        )
        if not all(np.all(np.isfinite(value)) for value in sample):
            return self._hold("non-finite measurement")
        history = self.assembler.update(self._history, sample)
        observation = self.assembler.flatten(history)
        action = self._policy(observation)
        if not np.all(np.isfinite(action)):
            return self._hold("non-finite policy output")
        self._history, self.observation = history, observation
        self.action = self._transform.clip_action(action)
        self.target_rad = self._transform.step(self.target_rad, self.action)
        self.fault, self.faults = "", 0
        return self.target_rad.copy()

    def _hold(self, reason: str) -> Array:
        self.fault, self.faults = reason, self.faults + 1
        return self.target_rad.copy()
