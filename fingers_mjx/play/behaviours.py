"""The robot's behaviours in the closed loop: recovery, detector, ramp, next policy.

`fingers_robot.behaviour.Policies` decides which policy runs and when a ramp moves the
targets; here it has the calls of a `PolicyController`.
"""

import numpy as np
from jaxtyping import Float

from envs.errors import InputError
from fingers_deploy import Bundle, PolicyController
from fingers_deploy.policy import Runtime
from fingers_robot.behaviour.command import DEADZONE, FixedCommand, Ranges
from fingers_robot.behaviour.exchange import Answer, Query
from fingers_robot.behaviour.policies import Policies
from fingers_robot.behaviour.sources import Sources
from fingers_robot.safety import PolicyFault


class Behaviours:
    """A recovery policy, and the policy to which it leads, under the robot's rules.

    Args:
        recovery: policy that the operator has selected.
        then: policy that takes over in the stance; None holds the stance instead.
        command: of that policy, held all the time; its fastest forward motion if None.
        runtime: what runs the policies.

    Raises:
        InputError: a command outside the training range of `then`.
    """

    def __init__(
        self,
        recovery: Bundle,
        then: Bundle | None = None,
        command: tuple[float, ...] | None = None,
        runtime: Runtime = "auto",
    ):
        bundles = (recovery,) if then is None else (then, recovery)
        self._controllers = tuple(PolicyController(b, runtime) for b in bundles)
        self._selected = len(bundles) - 1
        interface = recovery.manifest.interface
        self._dt_s = 1.0 / interface.control_rate_hz
        sticks = (1.0,)
        if command is not None:
            sticks = sticks_for(command, bundles[0].manifest.interface.command_ranges)
        self._source = FixedCommand(sticks)
        self.reset(interface.initial_target_rad)

    def reset(
        self, target_rad: Float[np.ndarray, " joints"] | tuple[float, ...]
    ) -> None:
        """Starts an episode with the joint targets `target_rad` [rad] on the wire."""
        self._policies = Policies(self._controllers, Sources(self._source))
        self.target_rad = np.asarray(target_rad, float)
        self.tick = -1
        self._ask(
            np.zeros(len(target_rad)), np.array([0.0, 0.0, -1.0]), np.zeros(3), False
        )

    def step(
        self,
        joint_pos: Float[np.ndarray, " joints"],
        gravity_b: Float[np.ndarray, "3"],
        angvel_b: Float[np.ndarray, "3"],
        command: Float[np.ndarray, " n"],
    ) -> Float[np.ndarray, " joints"]:
        """Returns the joint targets [rad] of this control step.

        Args:
            joint_pos: joint angles [rad].
            gravity_b: unit vector of gravity in the palm frame.
            angvel_b: angular velocity of the palm [rad/s].
            command: of the environment; not used, the operator's counts.
        """
        del command
        answer = self._ask(joint_pos, gravity_b, angvel_b, True)
        self.target_rad = np.array(answer.proposal.target_rad)
        known = answer.command[np.isfinite(answer.command)]
        self.command = np.zeros(3, np.float32)
        self.command[: len(known)] = known
        self.faults = int(answer.proposal.fault != PolicyFault.NONE)
        return self.target_rad.astype(np.float32)

    @property
    def action(self) -> Float[np.ndarray, " joints"]:
        """Last clipped output of the policy that runs."""
        return self._controllers[self._policies.active].action

    @property
    def settling(self) -> bool:
        """Whether the detector has fired and a ramp has the targets."""
        return self._policies.settling

    @property
    def handed_over(self) -> bool:
        """Whether the policy to which recovery leads runs now."""
        return self._policies.active != self._selected

    def _ask(
        self,
        joint_pos: Float[np.ndarray, " joints"],
        gravity_b: Float[np.ndarray, "3"],
        angvel_b: Float[np.ndarray, "3"],
        runs: bool,
    ) -> Answer:
        self.tick += runs
        query = Query(
            tick=self.tick,
            t_s=max(self.tick, 0) * self._dt_s,
            joint_pos=np.array(joint_pos, float),
            quat_w=orientation_of(gravity_b),
            gyro_b=np.array(angvel_b, float),
            target_rad=self.target_rad,
            runs=runs,
            policy=self._selected,
        )
        return self._policies.answer(query)


def sticks_for(command: tuple[float, ...], ranges: Ranges) -> tuple[float, ...]:
    """Stick positions that ask for a command; the inverse of `stick_command`.

    Args:
        command: one value for each entry of `ranges`.
        ranges: lowest and highest value of each entry in training.

    Raises:
        InputError: a value outside its range.
    """
    sticks = []
    for index, (value, (low, high)) in enumerate(zip(command, ranges, strict=True)):
        if not low <= value <= high:
            raise InputError("--command", f"[{index}]", value, f"{low:g} to {high:g}")
        end = high if value > 0 else -low
        share = abs(value) / end if value else 0.0
        out = DEADZONE + (1.0 - DEADZONE) * share if value else 0.0
        sticks.append(float(np.copysign(out, value)))
    return tuple(sticks)


def orientation_of(gravity_b: Float[np.ndarray, "3"]) -> Float[np.ndarray, "4"]:
    """Returns the shortest rotation, w x y z, under which gravity has that direction.

    q = (1 + c, g × d) normalized, with d = (0, 0, −1) and c = g · d. Its heading means
    nothing. Upside down, where the shortest rotation is not unique, it is half a turn
    about x.

    Args:
        gravity_b: unit vector of gravity in the palm frame.
    """
    x, y, z = np.asarray(gravity_b, float) / np.linalg.norm(gravity_b)
    if 1.0 - z < 1e-9:
        return np.array([0.0, 1.0, 0.0, 0.0])
    quat = np.array([1.0 - z, -y, x, 0.0])
    return quat / np.linalg.norm(quat)
