"""Walking quality against disturbances between hand and policy, as one figure.

    python deploy/benchmarks/walking_quality.py --out FIGURE.png

draws it for the committed policy and prints the numbers. Quality is that of the policy
with the supervisor's limits on age and freezing off; where the supervisor as it is
stops the hand, the point is marked.
"""

import argparse
import copy
import json
import sys
import tempfile
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from faults.lab import Lab
from faults.links import LossyLink
from hand_files import WALKING, write_model

from fingers_deploy.bundle import load_bundle
from fingers_deploy.rotations import gravity, multiply, tilt, unrotate
from fingers_robot.behaviour.heading import heading
from fingers_robot.reading import Health
from fingers_robot.safety import Mode

LOSS = (0.0, 0.05, 0.10, 0.20, 0.30, 0.40, 0.50)
LATENCY_S = (0.0, 0.005, 0.010, 0.020, 0.030, 0.040, 0.050, 0.060)
FROZEN_S = (0.0, 0.010, 0.020, 0.030, 0.040, 0.050, 0.080, 0.120)
EVERY_S = 1.0


class Late:
    """Delivers every sample some time after it was taken, with its true time."""

    def __init__(self, delay_s: float):
        self._delay_s = delay_s
        self._kept: dict[type, deque] = {}

    def __call__(self, sample, t):
        """Returns the newest sample that is old enough."""
        if isinstance(sample, Health):
            return sample
        line = self._kept.setdefault(type(sample), deque())
        line.append(sample)
        while len(line) > 1 and line[1].t_s <= t - self._delay_s + 1e-9:
            line.popleft()
        return line[0]


class Freezing:
    """Freezes all values for a while, every second, as if they still arrived."""

    def __init__(self, frozen_s: float):
        self._frozen_s = frozen_s
        self._kept: dict[type, object] = {}

    def __call__(self, sample, t):
        """Returns the sample, or the one from before the freeze."""
        if isinstance(sample, Health):
            return sample
        if t % EVERY_S >= self._frozen_s or type(sample) not in self._kept:
            self._kept[type(sample)] = sample
        return replace(self._kept[type(sample)], t_s=sample.t_s)


def walk(start: Lab, tamper: Callable, seconds: float, watched: bool) -> dict:
    """Walks under a disturbance; returns speed along V's x axis, tilt, survival."""
    lab = copy.deepcopy(start)
    if not watched:
        off = {"obs_age_s": 9.0, "frozen_joints_s": 9.0, "frozen_imu_s": 9.0}
        lab.core._limits = tuple(replace(x, **off) for x in lab.core._limits)
    lab.driver.tamper = tamper
    v_quat, data = lab.core.limits.v_quat_b, lab.driver.hand.data
    speeds, tilts, begin = [], [], lab.clock.t
    before = data.qpos[:2].copy()
    while lab.clock.t - begin < seconds and lab.mode == Mode.ACTIVE:
        lab.run(0.1)
        quat = data.qpos[3:7]
        angle = heading(multiply(quat, v_quat))
        moved, before = data.qpos[:2] - before, data.qpos[:2].copy()
        speeds.append((moved @ (np.cos(angle), np.sin(angle))) / 0.1)
        tilts.append(np.rad2deg(np.abs(tilt(unrotate(v_quat, gravity(quat)))).max()))
    return {
        "speed_mps": float(np.mean(speeds)),
        "tilt_deg": float(np.quantile(tilts, 0.95)),
        "lasted": (lab.clock.t - begin) / seconds,
        "why": [f.id for f in lab.core.state.faults],
    }


def measure(start: Lab, seconds: float, trials: int) -> dict:
    """Walks under each disturbance, several times."""
    kinds: dict[str, tuple[tuple[float, ...], Callable]] = {
        "packet loss": (LOSS, lambda x, k: LossyLink(x, np.random.default_rng(k))),
        "latency [s]": (LATENCY_S, lambda x, k: Late(x)),
        "frozen, every second [s]": (FROZEN_S, lambda x, k: Freezing(x)),
    }
    results = {}
    for name, (levels, make) in kinds.items():
        rows = []
        for level in levels:
            done = []
            for k in range(trials):
                shifted = copy.deepcopy(start).run(0.13 * k)
                result = walk(shifted, make(level, k), seconds, watched=False)
                watched = walk(shifted, make(level, k), seconds, watched=True)
                result |= {"lasted": watched["lasted"], "why": watched["why"]}
                done.append(result)
            rows.append(
                {
                    "level": level,
                    "speed_mps": [d["speed_mps"] for d in done],
                    "tilt_deg": float(np.mean([d["tilt_deg"] for d in done])),
                    "lasted": float(np.mean([d["lasted"] for d in done])),
                    "why": sorted({w for d in done for w in d["why"]}),
                }
            )
            print(name, json.dumps(rows[-1]), flush=True)
        results[name] = rows
    return results


def draw(results: dict, path: Path) -> None:
    """Draws speed and tilt against each disturbance."""
    figure, axes = plt.subplots(
        2, len(results), figsize=(10, 5), sharey="row", sharex="col"
    )
    for column, (name, rows) in enumerate(results.items()):
        levels = [row["level"] for row in rows]
        speed = np.array([row["speed_mps"] for row in rows])
        top, bottom = axes[0, column], axes[1, column]
        top.plot(levels, speed.mean(axis=1), "o-", color="C0")
        top.fill_between(
            levels, speed.min(axis=1), speed.max(axis=1), alpha=0.2, color="C0"
        )
        bottom.plot(levels, [row["tilt_deg"] for row in rows], "s-", color="C1")
        for row in rows:
            if row["lasted"] < 1:
                for axis in (top, bottom):
                    axis.axvline(row["level"], color="C3", alpha=0.3, linewidth=6)
        bottom.set_xlabel(name)
    axes[0, 0].set_ylabel("forward speed [m/s]")
    axes[1, 0].set_ylabel("tilt, 95 % [°]")
    figure.suptitle("Walking under disturbances; red: the supervisor stops the hand")
    figure.tight_layout()
    figure.savefig(path, dpi=120)


def main() -> int:
    """Runs the measurement, prints the numbers and draws the figure."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bundle", type=Path, default=WALKING)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--trials", type=int, default=3)
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args()
    bundle = load_bundle(options.bundle)
    with tempfile.TemporaryDirectory() as folder:
        model = write_model(Path(folder) / "hand.xml")
        lab = Lab(model, (bundle,), sticks=(1.0, 0.0, 0.0), loop_hz=500)
        results = measure(lab.activate().run(2.0), options.seconds, options.trials)
    draw(results, options.out)
    return 0


if __name__ == "__main__":
    sys.exit(main())
