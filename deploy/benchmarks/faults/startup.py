"""S17 and S20: what goes wrong before the policy runs."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from faults.lab import Lab

from fingers_deploy.bundle import Bundle
from fingers_robot.reading import Reading
from fingers_robot.safety import Mode, Operator

LARGEST_STEP_RAD = 0.02
ABDUCTION = (1, 5, 9, 13, 17)


@dataclass(frozen=True)
class Start:
    """What one start showed.

    Attributes:
        active: the policy ran in the end.
        rows: faults that were latched, `preflight` if a check failed, `refused` if
            arming was.
        step_rad: largest change of a target from one step to the next while arming,
            the first target against the measured pose.
    """

    active: bool
    rows: str
    step_rad: float


def _swapped(lab: Lab, rng: np.random.Generator) -> None:
    first, second = rng.choice(20, 2, replace=False)
    order = np.arange(20)
    order[[first, second]] = second, first
    _pose(lab, lambda pos: pos[order])


def _left_hand(lab: Lab, rng: np.random.Generator) -> None:
    """The abduction joints of a left hand turn the other way."""
    sign = np.ones(20)
    sign[list(ABDUCTION)] = -1.0
    _pose(lab, lambda pos: sign * pos)


def _zeros(lab: Lab, rng: np.random.Generator) -> None:
    """The cache before the first frame: all zeros, unlike the slow path."""
    _fast(lab, lambda pos: np.zeros(20))


def _no_power(lab: Lab, rng: np.random.Generator) -> None:
    lab.driver.obeys_power = False


def _far_pose(lab: Lab, rng: np.random.Generator) -> None:
    """Every joint is up to 0.2 rad away from its target, the hand in the air."""
    hand = lab.driver.hand
    low, high = hand.joint_limits_rad.T
    away = lab.core.limits.rest_rad + rng.uniform(-0.2, 0.2, 20)
    hand.data.qpos[hand._qpos] = np.clip(away, low, high)
    hand.data.qpos[2] += 0.3
    hand.model.opt.gravity[:] = 0.0


def _wrong_filter(lab: Lab, rng: np.random.Generator) -> None:
    lab.driver.info = replace(lab.driver.info, lowpass_hz=10.0)


def _other_order(lab: Lab, rng: np.random.Generator) -> None:
    names = list(lab.driver.info.joint_names)
    rng.shuffle(names)
    lab.driver.info = replace(lab.driver.info, joint_names=tuple(names))


# A wrong hand pushes against itself, or falls, before the wiggle test gets to it.
_WRONG = {"S17", "S5", "S7", "S8", "S8b", "preflight", "refused"}
STARTS: dict[str, tuple[set[str], Callable, bool]] = {
    "S17 two joints swapped": (_WRONG, _swapped, False),
    "S17 left hand": (_WRONG, _left_hand, False),
    "S17 joint names in another order": ({"preflight"}, _other_order, False),
    "S17 low-pass at 10 Hz": ({"preflight"}, _wrong_filter, False),
    "S20 cache still zero": ({"preflight"}, _zeros, False),
    "S20 power not confirmed": ({"S20"}, _no_power, False),
    "S20 pose far from the stance": ({"S5"}, _far_pose, True),
}
"""Name: rows of which one must stop it, the fault, whether it may run all the same.

A hand far from its stance may run, unless its fingers are caught in each other."""


def start_up(model: Path, bundle: Bundle, name: str, seed: int, hz: float) -> Start:
    """Arms a hand that has this fault from the beginning."""
    rows, install, _ = STARTS[name]
    rng = np.random.default_rng(seed)
    wiggle = tuple(range(20)) if rows == _WRONG else (int(rng.integers(20)),)
    if name.endswith("stance"):
        wiggle = ()
    lab = Lab(model, (bundle,), loop_hz=hz, wiggle=wiggle, seed=seed)
    install(lab, rng)
    lab.run(0.3)
    pose = lab.core.state.pose_rad
    lab.tick(Operator.ARM)
    while lab.mode == Mode.ARMING:
        lab.tick()
    targets = np.array([pose, *(target for _, target in lab.driver.written)])
    lab.run(1.0)
    step = float(np.abs(np.diff(targets, axis=0)).max()) if len(targets) > 1 else 0.0
    latched = [fault.id for fault in lab.core.state.faults]
    if not all(check.passed for check in lab.core.checks):
        latched.append("preflight")
    if any("arm refused" in line for _, line in lab.events):
        latched.append("refused")
    return Start(lab.mode == Mode.ACTIVE, " ".join(latched), step)


def stopped_rightly(start: Start, name: str) -> bool:
    """Whether a start ended as it must, without a large step."""
    rows, _, may_run = STARTS[name]
    named = bool(rows & set(start.rows.split()))
    right = may_run if start.active else named
    return right and start.step_rad <= LARGEST_STEP_RAD


def _pose(lab: Lab, change: Callable) -> None:
    """Changes both paths' angles, as a wrong hand does; its targets are not changed."""
    _fast(lab, change)
    lab.driver.tamper_health = lambda h: replace(h, pos_rad=change(h.pos_rad))


def _fast(lab: Lab, change: Callable) -> None:
    def tamper(sample, t):
        if isinstance(sample, Reading):
            return replace(sample, pos_rad=change(sample.pos_rad))
        return sample

    lab.driver.tamper = tamper
