"""Recovery in the closed loop: how the shim ends it, and what comes after."""

import dataclasses
from typing import Any

import jax.numpy as jnp
import numpy as np

from envs.batch import BatchEnv
from envs.errors import InputError
from envs.memory import Memory
from fingers_deploy import Bundle
from fingers_deploy.policy import Runtime
from fingers_mjx.play.behaviours import Behaviours
from fingers_mjx.play.player import Played, Player
from fingers_robot.behaviour.policies import RECOVERY


class RecoveryPlayer(Player):
    """Plays recovery with the shim's detector and ramp, and then another policy.

    Args:
        env: worlds of the recovery task.
        bundle: the recovery policy.
        then: policy that takes over once the ramp is over; None holds the stance.
        command: of that policy, see `Behaviours`.
        runtime: what runs the policies.

    Raises:
        BundleError: the joints of a bundle are not those of the hand.
        InputError: a command outside the training range.
    """

    def __init__(
        self,
        env: BatchEnv,
        bundle: Bundle,
        then: Bundle | None = None,
        command: tuple[float, ...] | None = None,
        runtime: Runtime = "auto",
    ):
        super().__init__(env, bundle, runtime)
        self.behaviours = Behaviours(bundle, then, command, runtime)
        self.controller: Any = self.behaviours
        judge = self._judge
        self._judge = lambda memory, *rest: judge(self._noted(memory), *rest)

    def take_over(self, other: Player) -> None:
        """Goes on with the shim of another player; see `Player.take_over`."""
        super().take_over(other)
        self.behaviours = self.controller

    def _noted(self, memory: Memory) -> Memory:
        """Enters what the shim did into what the environment keeps of the episode."""
        task, shim = memory.task, self.behaviours
        if shim.settling and not bool(task.settling.begun):
            since = jnp.asarray(memory.steps, jnp.int32)
            start = jnp.asarray(shim.target_rad, jnp.float32)
            settling = task.settling.replace(ramp_since=since, start_rad=start)
            task = task.replace(settling=settling)
        command = jnp.asarray(shim.command)
        return dataclasses.replace(memory, task=task, command=command)


def is_recovery(bundle: Bundle) -> bool:
    """Whether the robot ends the bundle's episodes as recoveries."""
    return bundle.manifest.task == RECOVERY


def check_chain(first: Bundle, then: Bundle) -> None:
    """Refuses policies of which one cannot follow the other.

    Raises:
        InputError: the first is no recovery, the second is one, or they were trained
            for different hands.
    """
    if not is_recovery(first):
        raise InputError("--then", "", first.manifest.task, "a recovery policy before")
    if is_recovery(then):
        raise InputError("--then", "task", RECOVERY, "a policy of another task")
    for name in ("joint_names", "v_quat_b", "initial_target_rad", "control_rate_hz"):
        before, after = (getattr(b.manifest.interface, name) for b in (first, then))
        if before != after:
            raise InputError("--then", name, after, f"{before}, as in {first.source}")


def story(played: Played, dt_s: float, then: str | None) -> str:
    """Returns one sentence on what happened in an episode of a `RecoveryPlayer`.

    Args:
        played: the episode.
        dt_s: control interval [s].
        then: name of the policy that was to follow.
    """
    extra = played.trace.extra
    fired, settled = (np.asarray(extra[k]) > 0 for k in ("settling", "settled"))
    total_s = len(fired) * dt_s
    if not fired.any():
        ran = f"; {then} did not run" if then else ""
        return f"the hand was never upright for 0.5 s within {total_s:.1f} s{ran}"
    text = f"upright after {fired.argmax() * dt_s:.1f} s"
    if not settled.any():
        return f"{text}; the episode ended before it had settled"
    begin = settled.argmax()
    text += f", in the stance after {begin * dt_s:.1f} s"
    if then is None:
        error = float(extra["joint_error_rad"][-1])
        return f"{text}, mean joint error {error:.4f} rad at the end"
    path = played.trace.palm_pos_w[begin:, :2]
    away = float(np.linalg.norm(path[-1] - path[0]))
    return f"{text}; {then} then went {away:.2f} m in {total_s - begin * dt_s:.1f} s"
