"""Draws hidden cases: a stand, an effect of a given visibility, and the log of it.

Visibility is the error on the recording that the believed model makes at best, over
noise: nominal parameters are first moved within their tolerances as far as that helps.
The beginning does not count: how a joint stands before the first target is not known.
"""

import math
from dataclasses import dataclass, field, replace

import numpy as np

from benchmarks.diagnosis.hidden.conditions import Conditions, parts_of
from benchmarks.diagnosis.hidden.recording import Recording
from benchmarks.diagnosis.hidden.sampling import exact, record, ticks
from benchmarks.diagnosis.hidden.scaling import logged, scaled_mechanism, scaled_stand
from benchmarks.diagnosis.hidden.sizes import SCALES
from benchmarks.diagnosis.hidden.stands import (
    Stand,
    changed,
    make_stand,
    slightly_wrong,
)
from benchmarks.diagnosis.hidden.truth import Mechanism
from sysid.logs.log import MeasuredLog

RATIOS = {"weak": 1.3, "medium": 2.0, "strong": 4.0}
SLOW = ("thermal_derating", "clock_drift", "packet_reorder")
"""Effects that a single round does not show, or not as the others do."""

SMALL = 0.1
"""Share by which a nominal parameter is moved to see what its tolerance does."""

SETTLED_S = 0.5
"""Time after which a record does not depend on how the joint stood before [s]."""


@dataclass(frozen=True)
class Case:
    """A hidden case.

    Attributes:
        seed: of everything drawn.
        stand: what is believed.
        truth: what is really there.
        effects: names of the hidden effects, the strongest first.
        joint: name of the joint that has them.
        magnitude: `weak`, `medium`, `strong`, or "" for none and invisible ones.
        ratio: error over noise that was reached.
        logs: what was measured.
    """

    seed: int
    stand: Stand
    truth: Mechanism
    effects: tuple[str, ...]
    joint: str
    magnitude: str
    ratio: float
    logs: tuple[MeasuredLog, ...] = field(repr=False)


def draw_case(
    seed: int,
    effects: tuple[str, ...] = (),
    magnitude: str = "medium",
    kind: str = "pendulum",
    round_s: float = 12.0,
    lowpass_hz: float | None = None,
) -> Case:
    """Draws a case under the usual conditions.

    Args:
        seed: of everything.
        effects: names of effects to hide, all in the same joint.
        magnitude: of each of them alone; `invisible` for a torque limit that the
            motion never reaches.
        kind: stand.
        round_s: length of a round of the standard recording [s].
        lowpass_hz: cutoff of the firmware; drawn from 3 and 15 Hz if not given.
    """
    usual = Conditions(rig=kind, round_s=round_s, lowpass_hz=lowpass_hz or 0.0)
    return drawn_case(seed, effects, magnitude, usual)


def drawn_case(
    seed: int, effects: tuple[str, ...], magnitude: str, conditions: Conditions
) -> Case:
    """Draws a case under given conditions; for the others see `draw_case`."""
    rng = np.random.default_rng([seed, 1])
    noise = conditions.noise()
    cutoff = conditions.lowpass_hz or float(rng.choice([3.0, 15.0]))
    stand = conditions.of_stand(make_stand(conditions.rig, rng, cutoff), rng)
    once = conditions.once(rng, stand)
    truth = base = slightly_wrong(stand.mechanism, rng, stand.tolerances)
    joint = int(rng.choice(stand.moved))
    if magnitude == "invisible":
        stand, truth = _out_of_reach(stand, base, joint, once, rng)
    ratio = 1.0
    shapes = int(rng.integers(2**31))
    for index, name in enumerate(effects if magnitude != "invisible" else ()):
        shown = (once, noise, shapes + index, conditions.effort)
        find = _Finder(stand, base, joint, name, *shown)
        size, ratio = find.size(RATIOS[magnitude])
        truth = find.hidden(truth, size)
    log = record(
        truth,
        conditions.whole(once, rng, stand),
        noise,
        rng,
        palm_quat_w=stand.mechanism.base_quat_w,
        source=f"hidden case {seed}",
    )
    if conditions.scale != 1.0 or not conditions.effort:
        log = logged(log, conditions.scale, conditions.effort)
        truth = scaled_mechanism(truth, conditions.scale)
        stand = scaled_stand(stand, conditions.scale)
    name = stand.names[joint]
    return Case(seed, stand, truth, effects, name, magnitude, ratio, (log,))


def _out_of_reach(stand, base, joint, once, rng) -> tuple[Stand, Mechanism]:
    """Adds a torque limit above all that the motion asks for.

    The believed limit is higher still: otherwise it would be the one that acts, and
    what is hidden would not be there at all.
    """
    free = _limited(base, joint, math.inf)
    times = np.arange(len(once.targets)) / once.rate_hz
    most = float(np.max(np.abs(exact(free, once, times)[1][:, joint])))
    limit = rng.uniform(1.5, 3.0) * most
    believed = max(4.0 * most, stand.mechanism.joints[joint].limit_nm)
    stand = replace(stand, mechanism=_limited(stand.mechanism, joint, believed))
    truth = _limited(base, joint, believed)
    return stand, truth.with_effect(joint, "torque_limit", limit_nm=limit)


def _limited(mechanism: Mechanism, joint: int, limit_nm: float) -> Mechanism:
    """The mechanism with another torque limit of a joint."""
    changed_ = replace(mechanism.joints[joint], limit_nm=limit_nm)
    return mechanism.with_joint(joint, changed_)


class _Finder:
    """Finds the size at which an effect has a given visibility."""

    def __init__(self, stand, base, joint, name, once, noise, shapes, effort=True):
        self.base, self.joint, self.name = base, joint, name
        self.scale, self.shapes = SCALES[name], shapes
        self.repeat = 3 if name in SLOW else 1
        targets = np.tile(once.targets, (self.repeat, 1))
        self.recording = Recording(once.rate_hz, targets, parts_of(once, self.repeat))
        self.times = ticks(self.recording, noise, np.random.default_rng(shapes))
        speed = float(np.std(np.diff(once.targets, axis=0))) * once.rate_hz
        self.sigma = noise.deviations(speed)
        self.moved = list(stand.moved)
        self.tolerances = {
            name: by
            for name, by in stand.tolerances.items()
            if name != self.scale.release
        }
        self.effort = effort
        self.plain = self._seen(base)
        self.changes = np.stack([self._change(name) for name in self.tolerances], 1)
        gram = self.changes.T @ self.changes + np.eye(len(self.tolerances))
        self.solve = np.linalg.inv(gram)

    def _seen(self, mechanism: Mechanism) -> np.ndarray:
        """Angles and torques of the recorded joints, in deviations of their noise."""
        angle, torque, _ = exact(mechanism, self.recording, self.times)
        kept = self.times > SETTLED_S
        parts = (angle[kept][:, self.moved], torque[kept][:, self.moved])
        scaled = [x / s for x, s in zip(parts, self.sigma, strict=True)]
        scaled = scaled if self.effort else scaled[:1]
        return np.concatenate([x.ravel() for x in scaled])

    def _change(self, name: str) -> np.ndarray:
        """How the record changes when a nominal parameter moves by its tolerance."""
        by = self.tolerances[name]
        small = min(by, SMALL)
        moved = changed(self.base, self.joint, name, small)
        return (self._seen(moved) - self.plain) * (by / small)

    def hidden(self, mechanism: Mechanism, size: float) -> Mechanism:
        """The mechanism with the effect; its shape is the same at every size."""
        shape = np.random.default_rng(self.shapes)
        return self.scale.apply(mechanism, self.joint, size, shape)

    def ratio(self, size: float) -> float:
        """Error over noise at a size."""
        moved = self._seen(self.hidden(self.base, size)) - self.plain
        if not np.all(np.isfinite(moved)):
            return math.inf
        rest = moved - self.changes @ (self.solve @ (self.changes.T @ moved))
        return math.sqrt(1.0 + float(rest @ rest) / rest.size)

    def size(self, target: float) -> tuple[float, float]:
        """Finds the size for a ratio; returns it with the ratio that it reaches.

        The excess error grows about with the square of the size, which gives the next
        guess inside a bracket. Where it jumps, the nearest of all guesses counts.
        """
        low, high = self.scale.low, self.scale.high
        size = math.sqrt(low * high)
        tried = []
        for _ in range(9):
            reached = self.ratio(size)
            short = (target**2 - 1.0) / max(reached**2 - 1.0, 1e-9)
            tried.append((abs(math.log(short)), size, reached))
            if tried[-1][0] < 0.1:
                break
            low, high = (size, high) if short > 1.0 else (low, size)
            guess = size * min(max(short, 1e-6), 1e6) ** 0.5
            size = guess if low < guess < high else math.sqrt(low * high)
        _, size, reached = min(tried)
        if size < self.scale.least:
            return self.scale.least, self.ratio(self.scale.least)
        return size, reached
