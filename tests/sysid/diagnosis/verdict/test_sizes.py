"""Intervals of a friction hold the true one, of records that are integrated here.

Nothing of the project's simulators makes them: a pendulum with dry friction behind a
servo, stepped at 10 kHz, all records side by side.
"""

from dataclasses import replace

import numpy as np
import pytest

from envs.physics.quiet_mujoco import mujoco
from sysid.diagnosis.diagnose import problem_of
from sysid.diagnosis.fits.candidate import fit_models
from sysid.diagnosis.replay.track import all_tracks
from sysid.diagnosis.search.judge import Judge
from sysid.diagnosis.search.search import Search
from sysid.diagnosis.search.settling import settled
from sysid.diagnosis.verdict.sizes import agreed, shows, sizes_of
from sysid.drive import JointDrive, Nominal
from sysid.logs.log import make_log
from sysid.mechanism import model_mechanism
from sysid.result import Estimate

EFFECT, NAME = "coulomb_friction", "torque_nm"
KP, KD, WEIGHT, INERTIA = 3.0, 0.05, 0.075, 0.01325
CUTOFF_HZ = 3.0
ROW_S, ROWS, DT = 0.02, 1600, 1e-4
ANGLE_RAD, EFFORT_NM = 1e-3, 1e-3
ARM = """
<mujoco><worldbody><body><joint name="servo" axis="0 1 0" armature="0.002"/>
<inertial pos="0 0 -0.15" mass="0.5" diaginertia="1e-5 1e-5 1e-5"/>
</body></worldbody></mujoco>"""


def targets(rng, many):
    """Eight waves for each of so many records [rad]."""
    t_s = ROW_S * np.arange(ROWS)[:, None, None]
    hz = rng.uniform(0.1, 1.5, (many, 8))
    phase = rng.uniform(0.0, 2.0 * np.pi, (many, 8))
    return 0.2 * np.sin(2.0 * np.pi * hz * t_s + phase).sum(2)


def moved(cmd, friction_nm):
    """Angles [rad] and torques [N·m] at every row: friction stops, and never pushes."""
    goal, q, v, rows = cmd[0].copy(), cmd[0].copy(), np.zeros(cmd.shape[1]), []
    for target in cmd:
        rows.append((q.copy(), KP * (goal - q) - KD * v))
        for _ in range(round(ROW_S / DT)):
            goal = goal + DT * 2.0 * np.pi * CUTOFF_HZ * (target - goal)
            pull = KP * (goal - q) - KD * v - WEIGHT * 9.81 * np.sin(q)
            v = v + DT * pull / INERTIA
            v = np.sign(v) * np.maximum(np.abs(v) - DT * friction_nm / INERTIA, 0.0)
            q = q + DT * v
    return np.moveaxis(np.array(rows), 1, 0)


def searches(friction_nm, seed=0):
    """One search for each friction that named it."""
    rng = np.random.default_rng(seed)
    cmd = targets(rng, len(friction_nm))
    angle, torque = moved(cmd, friction_nm)
    angle = angle + ANGLE_RAD * rng.normal(size=angle.shape)
    torque = torque + EFFORT_NM * rng.normal(size=angle.shape)
    t_s = ROW_S * np.arange(ROWS)
    for k in range(len(friction_nm)):
        read = {"pos.servo": angle[:, k], "tau.servo": torque[:, k]}
        yield named(make_log(("servo",), t_s, {"cmd.servo": cmd[:, k], **read}))


def named(log):
    """The search that found the effect, without looking at others."""
    path = {"lowpass_cutoff": {"cutoff_hz": Nominal(CUTOFF_HZ)}}
    drive = JointDrive(Nominal(KP), Nominal(KD), effects=path)
    mechanism = model_mechanism(mujoco.MjModel.from_xml_string(ARM), {"servo": drive})
    (track,) = all_tracks([log], mechanism)
    problem, base = settled(problem_of(track, [log], mechanism, False))
    start = base.fit.theta
    (best,) = fit_models(problem, [(EFFECT,)], [start], rounds=20)
    judge, without = Judge(problem, base), {EFFECT: base}
    return Search(problem, base, best, {}, without, [], problem.samples, judge)


def holds(search, true):
    """Whether the interval has the true friction, and how far off its middle is."""
    said = sizes_of(search)[EFFECT][NAME]
    return said.low <= true <= said.high, said.value / true - 1.0


def test_the_angle_sizes_what_equations_find_too_small():
    """Errors in the variables: all equations err to one side, half beyond 2.5 σ."""
    true = np.random.default_rng(3).uniform(0.01, 0.05, 4)
    angle, equations = [], []
    for search, friction in zip(searches(true), true, strict=True):
        assert shows(search, EFFECT)
        angle.append(holds(search, friction))
        search.judge.shows = lambda smaller, larger: False
        equations.append(holds(search, friction))
    assert all(inside and abs(error) < 0.03 for inside, error in angle)
    assert sum(inside for inside, _ in equations) <= 2
    assert all(error < -0.03 for _, error in equations)


def test_a_simulation_that_does_not_fit_sizes_nothing():
    """Its error is nine times the noise, where equations leave noise."""
    (search,) = searches(np.array([0.03]))
    moved, judge = search.judge.moved(search.best), search.judge
    by_angle = sizes_of(search)[EFFECT][NAME]
    judge.moved = lambda model: replace(moved, errors=np.array([0.0, 9.0]))
    said = sizes_of(search)[EFFECT][NAME]
    judge.shows = lambda smaller, larger: False
    assert said.value == sizes_of(search)[EFFECT][NAME].value != by_angle.value


SAID = Estimate(2.0, 1.9, 2.1, "N·m")


@pytest.mark.parametrize(
    ("other", "ends"),
    [
        (Estimate(2.05, 1.0, 3.0, "N·m"), (1.9, 2.1)),
        (Estimate(2.5, 2.0, 3.0, "N·m"), (1.9, 3.0)),
        (Estimate(1.0, 0.9, 1.1, "N·m"), (0.9, 2.1)),
    ],
)
def test_an_interval_holds_what_it_would_exclude(other, ends):
    assert agreed(SAID, other) == Estimate(2.0, *ends, "N·m")
