"""Plans of excitation: targets that make a joint show what it is.

A plan moves joints or groups of joints through waves, each repeated, inside the limits
of position, speed and torque. `sysid.excitation.check` simulates it with collisions and
makes it smaller where it would leave them; `sysid.excitation.separation` computes which
effects it excites, and which it distinguishes.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from envs.errors import InputError, one_of
from envs.physics.quiet_mujoco import mujoco
from sysid.excitation.waves import WAVES
from sysid.mechanism import Mechanism

REST_S = 0.5
"""Rest before every wave, so that it begins the same in every repeat."""


@dataclass(frozen=True)
class Limits:
    """What a plan must keep to.

    Attributes:
        margin_rad: distance from the ends of a joint's range.
        speed_rad_s: largest speed of targets and joints.
        torque_share: largest torque as share of the torque limit of the drive.
        reach_rad: largest distance from the middle of a motion.
    """

    margin_rad: float = 0.05
    speed_rad_s: float = 4.0
    torque_share: float = 0.9
    reach_rad: float = 0.5


@dataclass(frozen=True)
class Segment:
    """A wave of a plan.

    Attributes:
        wave: its name.
        joints: joints that move.
        repeat: number of the repeat, from 0.
        start_s, stop_s: when [s].
        amplitude_rad: by joint.
    """

    wave: str
    joints: tuple[str, ...]
    repeat: int
    start_s: float
    stop_s: float
    amplitude_rad: dict[str, float]


@dataclass(frozen=True, eq=False)
class Plan:
    """Targets and what they consist of.

    Attributes:
        joints: all joints of the mechanism that have a drive.
        rate_hz: rows in a second.
        targets: rows by joints [rad].
        segments: in order of time.
        limits: what it was made for.
        seed: of steps and phases.
    """

    joints: tuple[str, ...]
    rate_hz: float
    targets: Float[np.ndarray, "n j"]
    segments: tuple[Segment, ...]
    limits: Limits
    seed: int

    @property
    def moved(self) -> tuple[str, ...]:
        """Joints that move, in order."""
        moving = {joint for segment in self.segments for joint in segment.joints}
        return tuple(joint for joint in self.joints if joint in moving)

    @property
    def t_s(self) -> Float[np.ndarray, " n"]:
        """Time of every row [s]."""
        return np.arange(len(self.targets)) / self.rate_hz


def make_plan(
    mechanism: Mechanism,
    groups: Sequence[Sequence[str]],
    waves: Sequence[str] = tuple(WAVES),
    rate_hz: float = 100.0,
    repeats: int = 3,
    seed: int = 0,
    limits: Limits | None = None,
    scales: Mapping[tuple[str, str], float] | None = None,
    stretch: float = 1.0,
) -> Plan:
    """Makes a plan.

    Args:
        mechanism: joints and their ranges.
        groups: joints that move at the same time, one group after the other.
        waves: names of waves.
        rate_hz: rate at which targets are sent.
        repeats: how often each wave is repeated exactly.
        seed: of steps and phases, which differ between the joints of a group.
        limits: what to keep to.
        scales: factor on the amplitude by (wave, joint), for a plan made smaller.
        stretch: factor on the usual length of the waves.

    Raises:
        InputError: unknown joint or wave, or a joint without room to move.
    """
    limits, scales = limits or Limits(), scales or {}
    _check(mechanism, groups, waves)
    rest = rest_posture(mechanism)
    column = {joint: i for i, joint in enumerate(mechanism.joints)}
    parts, segments, rows = [], [], 0
    for group in groups:
        centers = {j: _room(mechanism, j, limits) for j in group}
        for name in waves:
            wave = WAVES[name]
            seconds = wave.seconds * stretch
            once = np.tile(rest, (round((seconds + REST_S) * rate_hz), 1))
            amplitudes = {}
            for joint in group:
                rng = np.random.default_rng([seed, column[joint], _number(name)])
                shape = wave.shape(seconds, rate_hz, rng)
                middle, reach = centers[joint]
                size = wave.share * reach * scales.get((name, joint), 1.0)
                if not wave.jumps:
                    fastest = np.max(np.abs(np.diff(shape))) * rate_hz
                    size = min(size, limits.speed_rad_s / max(fastest, 1e-9))
                amplitudes[joint] = float(size)
                once[:, column[joint]] = middle
                once[len(once) - len(shape) :, column[joint]] += size * shape
            for repeat in range(repeats):
                start = rows / rate_hz
                parts.append(once)
                rows += len(once)
                segment = (tuple(group), repeat, start + REST_S, rows / rate_hz)
                segments.append(Segment(name, *segment, amplitudes))
    targets = _joined(parts, limits, rate_hz)
    return Plan(mechanism.joints, rate_hz, targets, tuple(segments), limits, seed)


def _number(wave: str) -> int:
    return list(WAVES).index(wave)


def _check(mechanism: Mechanism, groups, waves) -> None:
    """Refuses names that do not exist."""
    for joint in [joint for group in groups for joint in group]:
        if joint not in mechanism.joints:
            raise InputError("plan", "joints", joint, one_of(mechanism.joints, joint))
    for wave in waves:
        if wave not in WAVES:
            raise InputError("plan", "waves", wave, one_of(WAVES, wave))
    if not waves or not any(groups):
        raise InputError("plan", "waves", "nothing to do", "at least one joint, wave")


def joint_range(mechanism: Mechanism, joint: str) -> tuple[float, float]:
    """Returns the range of a joint [rad]; ±π where the model has none."""
    found = mechanism.model.joint(joint)
    if not mechanism.model.jnt_limited[found.id]:
        return -np.pi, np.pi
    low, high = mechanism.model.jnt_range[found.id]
    return float(low), float(high)


def rest_posture(mechanism: Mechanism) -> Float[np.ndarray, " j"]:
    """Returns where joints stand that do not move: at 0, or the end nearest to it."""
    ranges = [joint_range(mechanism, joint) for joint in mechanism.joints]
    return np.array([np.clip(0.0, low, high) for low, high in ranges])


def _room(mechanism: Mechanism, joint: str, limits: Limits) -> tuple[float, float]:
    """Returns middle and reach of a joint's motion [rad]."""
    low, high = joint_range(mechanism, joint)
    low, high = low + limits.margin_rad, high - limits.margin_rad
    if high <= low:
        valid = f"a range of more than {2.0 * limits.margin_rad:g} rad"
        raise InputError("plan", joint, f"{high - low:.3g} rad of room", valid)
    reach = min(limits.reach_rad, 0.5 * (high - low))
    return float(np.clip(0.5 * (low + high), low + reach, high - reach)), reach


def _joined(parts: list, limits: Limits, rate_hz: float) -> Float[np.ndarray, "n j"]:
    """Joins waves; where the posture changes it glides during the rest."""
    targets = np.concatenate(parts)
    starts = np.cumsum([len(part) for part in parts])[:-1]
    rows = round(0.8 * REST_S * rate_hz)
    for start in starts:
        before, after = targets[start - 1], targets[start + rows]
        if np.any(before != after):
            share = 0.5 - 0.5 * np.cos(np.pi * np.arange(rows) / rows)
            targets[start : start + rows] = before + share[:, None] * (after - before)
    return targets


def joint_groups(mechanism: Mechanism, names: Sequence[str]) -> list[tuple[str, ...]]:
    """Returns joints one by one, and classes (a finger, `pip`, …) as groups.

    Raises:
        InputError: a name that is neither.
    """
    groups = []
    for name in names or mechanism.joints:
        if name in mechanism.classes:
            groups.append(tuple(mechanism.classes[name]))
        elif name in mechanism.joints:
            groups.append((name,))
        else:
            valid = one_of([*mechanism.joints, *mechanism.classes], name)
            raise InputError("plan", "joints", name, valid)
    return groups


def joint_address(mechanism: Mechanism) -> tuple[np.ndarray, np.ndarray]:
    """Returns where the joints stand in qpos and qvel."""
    model: mujoco.MjModel = mechanism.model
    ids = [model.joint(joint).id for joint in mechanism.joints]
    return model.jnt_qposadr[ids], model.jnt_dofadr[ids]
