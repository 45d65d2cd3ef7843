"""Conditions of a hidden record: who recorded what, how fast, and how much is known.

Each field is a factor of the battery, `LEVELS` are its levels. Figures of a mechanism
are scaled afterwards (`scaling`): all masses, torques and inertias by one factor, which
changes nothing but units.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.diagnosis.hidden.motions import MOTIONS, user_motion
from benchmarks.diagnosis.hidden.recording import Recording, standard
from benchmarks.diagnosis.hidden.sampling import Noise
from benchmarks.diagnosis.hidden.stands import Stand

LEVELS: Mapping[str, tuple] = {
    "rig": ("pendulum", "joint", "axis", "arm"),
    "lowpass_hz": (3.0, 15.0, math.inf),
    "effort": (True, False),
    "gains": ("5 %", "50 %", "unknown"),
    "rate_hz": (50.0, 100.0, 200.0, 500.0, 1000.0),
    "jitter": (0.0, 0.03, 0.15),
    "repeats": (True, False),
    "motion": ("planned", *MOTIONS),
    "scale": (0.01, 0.1, 1.0, 10.0, 100.0),
}

GAINS = {
    "5 %": {},
    "50 %": {"kp": 0.5, "kd": 0.5},
    "unknown": {"kp": 0.7, "kd": 0.7},
}
"""Tolerances of the gains where they are not the usual ones."""

DELAYS_ROWS = (0.0, 0.4, 1.7)
"""Delays of drives without a low-pass [rows]."""


@dataclass(frozen=True)
class Conditions:
    """How a record is made and what is known of its drive.

    Attributes:
        rig: kind of stand.
        lowpass_hz: cutoff of the firmware; infinite: neither low-pass nor limit of the
            speed; 0: drawn from 3 and 15 Hz.
        effort: whether the effort is logged.
        gains: how well the gains are known.
        rate_hz: rows in a second.
        clock: relative error of that rate.
        jitter: deviation of the host's ticks [rows].
        repeats: whether each motion comes three times.
        motion: `planned` excitation, or one of `motions.MOTIONS`.
        scale: factor of all masses, torques and inertias.
        round_s: length of a round [s]; there are three.
    """

    rig: str = "pendulum"
    lowpass_hz: float = 0.0
    effort: bool = True
    gains: str = "5 %"
    rate_hz: float = 200.0
    clock: float = 0.0
    jitter: float = 0.03
    repeats: bool = True
    motion: str = "planned"
    scale: float = 1.0
    round_s: float = 12.0

    @property
    def rows_hz(self) -> float:
        """Rows in a second by the clock of the log."""
        return self.rate_hz * (1.0 + self.clock)

    def noise(self) -> Noise:
        """What the host adds."""
        return Noise(jitter_s=self.jitter / self.rate_hz)

    def levels(self) -> dict[str, str]:
        """Returns the level of every factor as text."""
        return {name: str(getattr(self, name)) for name in LEVELS}

    def of_stand(self, stand: Stand, rng: np.random.Generator) -> Stand:
        """A stand whose drive has this command path and is known this well."""
        known = replace(
            stand,
            tolerances={**stand.tolerances, **GAINS[self.gains]},
            gains_free=self.gains == "unknown",
        )
        if not math.isinf(self.lowpass_hz):
            return known
        delay_s = float(rng.choice(DELAYS_ROWS)) / self.rate_hz
        mechanism = known.mechanism
        for index, joint in enumerate(mechanism.joints):
            plain = replace(joint, delay_s=delay_s, slew_rad_s=math.inf)
            mechanism = mechanism.with_joint(index, plain)
        return replace(known, mechanism=mechanism)

    def once(self, rng: np.random.Generator, stand: Stand) -> Recording:
        """One round of targets."""
        where = (stand.middle, stand.reach, self.rows_hz, self.round_s)
        if self.motion == "planned":
            return standard(rng, *where, 1)
        return user_motion(rng, self.motion, *where)

    def whole(
        self, once: Recording, rng: np.random.Generator, stand: Stand
    ) -> Recording:
        """Three rounds: the same one, or others of other sizes."""
        if self.repeats:
            targets = np.tile(once.targets, (3, 1))
            return Recording(once.rate_hz, targets, parts_of(once, 3))
        others = [
            self.once(rng, replace(stand, reach=rng.uniform(0.6, 1.0) * stand.reach))
            for _ in range(2)
        ]
        targets = np.concatenate([once.targets, *(o.targets for o in others)])
        return Recording(once.rate_hz, targets, parts_of(once, 3))


def parts_of(once: Recording, rounds: int) -> tuple[tuple[str, int, int, int], ...]:
    """Parts of several rounds of one recording."""
    n = len(once.targets)
    return tuple(
        (name, k, first + k * n, last + k * n)
        for k in range(rounds)
        for name, _, first, last in once.parts
    )
