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
from sysid.excitation.waves import WAVES
from sysid.mechanism import Mechanism, joint_range, rest_posture

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
class Schedule:
    """What is sent.

    Attributes:
        waves: names of waves, in order.
        rate_hz: rate at which targets are sent.
        repeats: how often each wave is repeated exactly.
        stretch: factor on the usual length of the waves.
        seed: of steps and phases, which differ between the joints of a group.
    """

    waves: tuple[str, ...] = tuple(WAVES)
    rate_hz: float = 100.0
    repeats: int = 3
    stretch: float = 1.0
    seed: int = 0


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
    schedule: Schedule = Schedule(),
    limits: Limits = Limits(),
    scales: Mapping[tuple[str, str], float] | None = None,
) -> Plan:
    """Makes a plan.

    Args:
        mechanism: joints and their ranges.
        groups: joints that move at the same time, one group after the other.
        schedule: which waves, how long and how often.
        limits: what to keep to.
        scales: factor on the amplitude by (wave, joint), for a plan made smaller.

    Raises:
        InputError: unknown joint or wave, or a joint without room to move.
    """
    _check(mechanism, groups, schedule.waves)
    rest, rate_hz = rest_posture(mechanism), schedule.rate_hz
    parts, segments, rows = [], [], 0
    for group in groups:
        rooms = {j: _room(mechanism, j, limits) for j in group}
        for name in schedule.waves:
            seconds = WAVES[name].seconds * schedule.stretch
            once = np.tile(rest, (round((seconds + REST_S) * rate_hz), 1))
            amplitudes = {}
            for joint, (middle, reach) in rooms.items():
                column = mechanism.joints.index(joint)
                shape = _shape(schedule, name, column)
                size = reach * (scales or {}).get((name, joint), 1.0)
                size = _amplitude(name, shape, size, limits.speed_rad_s / rate_hz)
                amplitudes[joint] = size
                once[:, column] = middle
                once[len(once) - len(shape) :, column] += size * shape
            for repeat in range(schedule.repeats):
                start = rows / rate_hz
                parts.append(once)
                rows += len(once)
                segment = (tuple(group), repeat, start + REST_S, rows / rate_hz)
                segments.append(Segment(name, *segment, amplitudes))
    targets, seed = _joined(parts, rate_hz), schedule.seed
    return Plan(mechanism.joints, rate_hz, targets, tuple(segments), limits, seed)


def _shape(schedule: Schedule, name: str, column: int) -> Float[np.ndarray, " n"]:
    """A wave between -1 and 1, drawn for one joint."""
    wave = WAVES[name]
    rng = np.random.default_rng([schedule.seed, column, list(WAVES).index(name)])
    return wave.shape(wave.seconds * schedule.stretch, schedule.rate_hz, rng)


def _amplitude(
    name: str, shape: Float[np.ndarray, " n"], reach: float, step_rad: float
) -> float:
    """Share of the reach that a wave takes, without steps that are too large."""
    wave = WAVES[name]
    size = wave.share * reach
    if not wave.jumps:
        size = min(size, step_rad / max(np.max(np.abs(np.diff(shape))), 1e-9))
    return float(size)


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


def _room(mechanism: Mechanism, joint: str, limits: Limits) -> tuple[float, float]:
    """Returns middle and reach of a joint's motion [rad]."""
    low, high = joint_range(mechanism, joint)
    low, high = low + limits.margin_rad, high - limits.margin_rad
    if high <= low:
        valid = f"a range of more than {2.0 * limits.margin_rad:g} rad"
        raise InputError("plan", joint, f"{high - low:.3g} rad of room", valid)
    reach = min(limits.reach_rad, 0.5 * (high - low))
    return float(np.clip(0.5 * (low + high), low + reach, high - reach)), reach


def _joined(parts: list, rate_hz: float) -> Float[np.ndarray, "n j"]:
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
