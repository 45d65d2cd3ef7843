"""Rows that jitter: what a curve between them loses is no effect."""

from dataclasses import replace

import numpy as np
import pytest
from support.plain_servo import ARM, problem_with, steps_taken

from benchmarks.diagnosis.battery import run_task
from benchmarks.diagnosis.plan import wide_plan
from envs.physics.quiet_mujoco import mujoco
from sysid.diagnosis.replay.band import sample_rows
from sysid.diagnosis.replay.track import all_tracks
from sysid.diagnosis.simulated.output_error import output_problem
from sysid.drive import JointDrive, Nominal
from sysid.logs.log import make_log
from sysid.mechanism import model_mechanism


@pytest.mark.parametrize(
    ("row_s", "jitter", "low", "high"),
    [(0.02, 0.2, 1e-3, 1e-1), (0.02, 0.0, 0.0, 1e-9), (0.05, 0.2, 0.0, 0.0)],
)
def test_the_angle_is_unsure_between_rows_that_jitter(row_s, jitter, low, high):
    """Not at even rows, nor in a slow log, which is looked at in its rows."""
    rows = np.arange(400)
    late = np.random.default_rng(0).uniform(-jitter, jitter, len(rows))
    t_s = row_s * (rows + late)
    columns = {"cmd.servo": 0.3 * np.floor(t_s), "pos.servo": steps_taken(t_s)}
    log = make_log(("servo",), t_s, columns)
    drive = JointDrive(Nominal(24.0), Nominal(0.7))
    mechanism = model_mechanism(mujoco.MjModel.from_xml_string(ARM), {"servo": drive})
    unread = all_tracks([log], mechanism)[0].unread
    assert low <= unread.max() <= high


def test_a_sample_between_rows_weighs_less_by_what_they_do_not_show():
    problem = problem_with()
    problem.data.effort[:] = False
    output = output_problem(problem)
    unread = np.zeros_like(output.data.unread)
    at = sample_rows(len(unread))[20]
    unread[at] = 1.0
    raw = np.random.default_rng(0).normal(size=(2, *output.fold.shape))
    lost = replace(output, data=replace(output.data, unread=unread)).with_noise(raw)
    sure = replace(output, data=replace(output.data, unread=0.0 * unread))
    before = sure.with_noise(raw).weight[1]
    assert np.flatnonzero(lost.weight[1] < 0.99 * before).tolist() == [20]


@pytest.mark.slow
@pytest.mark.parametrize("number", [305, 444])
def test_a_step_within_three_rows_is_not_unexplained(number):
    """Nothing is hidden; at 50 Hz the curve errs by milliradians there."""
    assert run_task(wide_plan(694322, [number])[0]).verdict in (
        "none",
        "not_observable",
    )
