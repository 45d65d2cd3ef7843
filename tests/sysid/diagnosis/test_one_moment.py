"""An effect that one moment of a record shows: parts of that moment are held out.

The record is integrated here, by none of the project's simulators, and has no effort.
"""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from envs.physics.quiet_mujoco import mujoco
from sysid.diagnosis.diagnose import diagnose, problem_of
from sysid.diagnosis.fits.candidate import fit_models, log_likelihood_gain
from sysid.diagnosis.likelihood import folds
from sysid.diagnosis.likelihood.folds import BLOCK_S, SHORTEST_S, shorter_blocks
from sysid.diagnosis.replay.track import all_tracks
from sysid.diagnosis.search.parts import in_parts
from sysid.diagnosis.search.selection import THRESHOLD
from sysid.diagnosis.search.settling import settled
from sysid.diagnosis.simulated.output_error import output_problem
from sysid.diagnosis.simulated.settled_output import settled_output
from sysid.drive import JointDrive, Nominal
from sysid.logs.log import make_log
from sysid.mechanism import model_mechanism

RATE_HZ, DT, LENGTH_S = 250.0, 0.0005, 12.0
KP, KD, INERTIA = 3.0, 0.3, 0.01325
KNOWN_NM, LIMIT_NM = 5.0, 0.7
AXIS = """
<mujoco><worldbody><body><joint name="servo" axis="0 0 1" armature="0.002"/>
<inertial pos="0.15 0 0" mass="0.5" diaginertia="1e-5 1e-5 1e-5"/>
</body></worldbody></mujoco>"""


def recorded(limit_nm=LIMIT_NM, seed=0):
    """A log of slow targets with one step, which alone meets the limit."""
    rng = np.random.default_rng(seed)
    t_s = np.arange(round(LENGTH_S * RATE_HZ)) / RATE_HZ
    phases = rng.uniform(0.0, 2.0 * np.pi, 4)
    waves = [np.sin(0.8 * (k + 1) * t_s + f) for k, f in enumerate(phases)]
    cmd = 0.1 * np.sum(waves, 0) + 0.7 * (t_s > 6.05)
    q, v, angle = cmd[0], 0.0, []
    for target in cmd:
        angle.append(q)
        for _ in range(round(1.0 / RATE_HZ / DT)):
            torque = np.clip(KP * (target - q) - KD * v, -limit_nm, limit_nm)
            v += DT * torque / INERTIA
            q += DT * v
    noise = 3e-4 * rng.normal(size=len(cmd))
    columns = {"cmd.servo": cmd, "pos.servo": np.array(angle) + noise}
    known = {"torque_limit": {"limit_nm": Nominal(KNOWN_NM)}}
    drive = JointDrive(Nominal(KP), Nominal(KD), effects=known)
    model = mujoco.MjModel.from_xml_string(AXIS)
    log = make_log(("servo",), t_s, columns)
    return [log], model_mechanism(model, {"servo": drive})


@pytest.fixture(scope="module")
def nominal():
    """The error of the angle, and the simulation without the lower limit."""
    logs, mechanism = recorded()
    (track,) = all_tracks(logs, mechanism)
    problem, base = settled(problem_of(track, logs, mechanism, company=False))
    return settled_output(output_problem(problem), base)


def limited(problem, base):
    """The model with the limit, fitted from the true one."""
    (where,) = problem.space.of("torque_limit")
    start = base.fit.theta.copy()
    start[where] = problem.space.slots[where].coordinate(LIMIT_NM)
    return fit_models(problem, [("torque_limit",)], [start], rounds=20)[0]


def gain(problem, base):
    """What the true limit gains on stretches that no fit saw."""
    return log_likelihood_gain(base, limited(problem, base), problem.samples)


def test_parts_of_the_moment_predict_each_other(nominal):
    """Whole seconds hardly do: what they gain is that no tolerance is strained."""
    problem, base = nominal
    shorter = in_parts(problem, base)
    assert shorter[0].block_s < problem.block_s == BLOCK_S
    gained = gain(*shorter)
    assert gained > 10.0 * THRESHOLD
    assert gain(problem, base) < 0.02 * gained


def test_parameters_that_fit_the_moment_hide_no_moment(nominal):
    """Off their priors they leave noise of it, and do not predict it all the same."""
    problem, base = nominal
    found = limited(problem, base)
    strained = replace(base, fit=found.fit, errors=found.errors)
    assert in_parts(problem, strained)[0].block_s < BLOCK_S
    predicted = np.tile(found.fit.theta, (len(base.fold_theta), 1))
    known = replace(strained, fold_theta=predicted)
    assert in_parts(problem, known) == (problem, known)


@pytest.mark.slow
def test_a_limit_that_one_step_meets_is_found():
    said = diagnose(*recorded())
    assert [c.effect for c in said.causes] == ["torque_limit"]
    found = said.causes[0].parameters["limit_nm"]
    assert found.value == pytest.approx(LIMIT_NM, rel=0.05)


def blocks(error, fold=None, noise=0.0):
    """Shortens blocks of a record of one piece, a sample every 10 ms."""
    data = SimpleNamespace(dt=0.01 / folds.EVERY, start_s=np.zeros(1))
    root = np.arange(len(error))[:, None]
    repeats = SimpleNamespace(root=root, root_piece=np.zeros_like(root))
    if fold is None:
        fold = (root // 100) % folds.FOLDS
    return shorter_blocks(data, repeats, fold, error[:, None] ** 2 - noise**2)


def test_blocks_are_as_short_as_the_moment():
    error = np.full(1200, 0.1)
    assert blocks(error)[1] == BLOCK_S
    error[425:475] = 10.0
    fold, length = blocks(error)
    assert length == pytest.approx(0.5)
    assert set(fold[425:475].ravel()) > {fold[425, 0]}
    error[:] = 0.0
    error[420:423] = 10.0
    assert SHORTEST_S <= blocks(error)[1] <= 2.0 * SHORTEST_S


def test_noise_hides_no_moment():
    """It is in all folds: of a long record it is most of the error."""
    error = np.random.default_rng(0).normal(size=12000)
    error[425:475] = 5.0
    assert blocks(error)[1] == BLOCK_S
    assert blocks(error, noise=1.0)[1] == pytest.approx(0.5)


def test_a_record_that_has_all_of_the_error_is_divided():
    error = np.full(1200, 1e-3)
    error[300:600] = 1.0
    record = (np.arange(1200)[:, None] // 300) % folds.FOLDS
    fold, length = blocks(error, record)
    assert length == BLOCK_S and len(set(fold[300:600].ravel())) == folds.FOLDS
    error[:] = 1.0
    assert blocks(error, record)[0] is record


def test_loads_stay_whole():
    """What a load does shows in the records with it, and in no other."""
    logs, mechanism = recorded()
    heavy = replace(logs[0].header, load=replace(logs[0].header.load, mass_kg=0.2))
    logs = [logs[0], replace(logs[0], header=heavy)]
    (track,) = all_tracks(logs, mechanism)
    problem = problem_of(track, logs, mechanism, company=False)
    base = SimpleNamespace()
    assert in_parts(problem, base) == (problem, base)
