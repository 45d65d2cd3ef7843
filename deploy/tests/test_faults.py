"""The fault matrix, small; `make test-slow` runs the large one."""

import numpy as np
import pytest
from faults.lab import Lab, snapshots
from faults.links import LOSSES, burst, measure_loss
from faults.processes import SIGNALS, WITHIN_S, kill_one, plain_options
from faults.scenarios import SCENARIOS
from faults.startup import STARTS, start_up, stopped_rightly
from faults.trials import passes, run_trial
from hand_files import WALKING, standing_bundle

from fingers_deploy import load_bundle
from fingers_robot.drivers.sim import SimulatorProcess
from fingers_robot.runtime.launcher import EXIT_TRIP, Launcher
from fingers_robot.safety import ROWS, Mode, Operator

SEED = 500
FAST, SLOW = 20, 100
ELSEWHERE = {"S17", "S20", "OP", "OFF"}  # of the table's rows: starts, and test_rows
IDS = [f"{s.row} {s.name}" for s in SCENARIOS]


@pytest.fixture(scope="module")
def starts(hand_model, marching):
    """Half a second of settling is enough here; the large version has all of it."""
    lab = Lab(hand_model, (marching,), loop_hz=250, settle_s=0.5)
    return snapshots(lab.activate().run(1.0), 20, 0.13)


@pytest.fixture(scope="module")
def fast_starts(hand_model, marching):
    lab = Lab(hand_model, (marching,), loop_hz=500).activate().run(1.0)
    return snapshots(lab, 20, 0.13)


def _check(starts, scenario, trials, seed):
    lab = starts[0]
    for k in range(trials):
        trial = run_trial(starts[k % len(starts)], scenario, seed + k)
        assert passes(trial, scenario, lab.core.limits.step_rad, lab.period_s), trial


def test_every_row_is_in_the_matrix():
    assert {s.row for s in SCENARIOS} | ELSEWHERE == {row.id for row in ROWS} | {"S19"}


@pytest.mark.parametrize("scenario", SCENARIOS, ids=IDS)
def test_the_matrix(starts, scenario):
    _check(starts, scenario, FAST, SEED)


def test_a_supervisor_that_sleeps_would_fail(starts):
    """Negative control: with its limits off, the trials do not pass."""
    import copy
    from dataclasses import replace

    lab = copy.deepcopy(starts[0])
    off = replace(lab.core.limits, obs_age_s=9.0, lease_s=9.0, frozen_imu_s=9.0)
    lab.core._limits = (off,)
    for name in ("late joints", "policy hangs", "frozen IMU"):
        scenario = next(s for s in SCENARIOS if s.name == name)
        trial = run_trial(lab, scenario, SEED)
        assert not passes(trial, scenario, 0.06, lab.period_s)


@pytest.mark.slow
@pytest.mark.parametrize("scenario", SCENARIOS, ids=IDS)
def test_the_matrix_large(fast_starts, scenario):
    print(f"seeds {SEED} to {SEED + SLOW - 1}")
    _check(fast_starts, scenario, SLOW, SEED)


@pytest.mark.parametrize("name", STARTS)
def test_faulty_starts(hand_model, marching, name):
    for seed in range(3):
        start = start_up(hand_model, marching, name, seed, 250)
        assert stopped_rightly(start, name), start


@pytest.mark.parametrize("share", LOSSES)
def test_packet_loss(fast_starts, share):
    assert measure_loss(fast_starts[0], share, 4.0, SEED).trips == 0


def test_bursts(starts):
    assert burst(starts[0], 0.030)[1] == Mode.ACTIVE
    reaction, end = burst(starts[0], 0.060)
    assert reaction <= 0.080 and end == Mode.STOPPING
    assert burst(starts[0], 0.500)[1] == Mode.SAFE


def test_no_false_stop(starts):
    import copy

    lab = copy.deepcopy(starts[3])
    lab.run(10.0)
    assert lab.mode == Mode.ACTIVE and lab.core.state.faults == ()
    heights = lab.driver.hand.data.qpos[2]
    assert np.isfinite(heights) and heights > 0.1


def test_the_trained_policy_walks_under_the_supervisor(hand_model):
    bundle = load_bundle(WALKING)
    lab = Lab(hand_model, (bundle,), sticks=(1.0, 0.0, 0.0), loop_hz=250).activate()
    begin = lab.driver.hand.data.qpos[:2].copy()
    lab.run(8.0)
    assert lab.mode == Mode.ACTIVE and lab.core.state.faults == ()
    assert np.linalg.norm(lab.driver.hand.data.qpos[:2] - begin) > 0.1


def test_switching_policies_while_walking(hand_model):
    """Back and forth every half second: no stop, no jump, and the hand still walks."""
    both, sticks = (load_bundle(WALKING),) * 2, (1.0, 0.0, 0.0)
    lab = Lab(hand_model, both, sticks=sticks, loop_hz=250).activate()
    lab.run(2.0).forget()
    for k in range(8):
        lab.core.selected = 1 - k % 2
        lab.run(0.5)
        assert lab.link.policies.active == 1 - k % 2
    targets = np.array([target for _, target in lab.driver.written])
    assert np.abs(np.diff(targets, axis=0)).max() <= lab.core.limits.step_rad + 1e-6
    begin = lab.driver.hand.data.qpos[:2].copy()
    lab.run(4.0)
    assert lab.mode == Mode.ACTIVE and lab.core.state.faults == ()
    assert np.linalg.norm(lab.driver.hand.data.qpos[:2] - begin) > 0.1


def test_switching_to_the_stance_of_another_task_and_back(hand_model):
    """From full speed: the hand stops, stands as for typing, and walks again."""
    both, sticks = (load_bundle(WALKING), standing_bundle("keyboard")), (1.0, 0.0, 0.0)
    lab = Lab(hand_model, both, sticks=sticks, loop_hz=250).activate()
    lab.run(2.0).forget()
    for number in (1, 0):
        lab.core.selected = number
        lab.run(8.0)
        assert lab.mode == Mode.ACTIVE and lab.core.state.faults == (), lab.events
        assert lab.link.policies.active == number
        # The limits are those of the policy that runs: in typing 15 degrees of tilt.
        assert lab.core.limits is lab.core._limits[number]
    targets = np.array([target for _, target in lab.driver.written])
    assert np.abs(np.diff(targets, axis=0)).max() <= 0.06 + 1e-6
    begin = lab.driver.hand.data.qpos[:2].copy()
    lab.run(4.0)
    assert np.linalg.norm(lab.driver.hand.data.qpos[:2] - begin) > 0.1


def test_a_hand_that_has_fallen_is_armed_for_recovery_only(hand_model):
    both = load_bundle(WALKING), standing_bundle("recovery")
    lab = Lab(hand_model, both, loop_hz=250).activate()
    lab.driver.hand.data.qpos[2:7] = 0.15, *(np.cos(0.6), np.sin(0.6), 0.0, 0.0)
    lab.run(12.0)
    lab.tick(Operator.CLEAR)
    assert lab.mode == Mode.SAFE and "clear refused: S7" in lab.events[-1][1]
    lab.core.selected = 1
    lab.run(0.1)
    lab.tick(Operator.CLEAR)
    assert lab.mode == Mode.DISABLED
    begins = lab.driver.read().pos_rad
    lab.forget()
    lab.activate()
    assert lab.link.policies.active == 1
    np.testing.assert_allclose(lab.driver.written[0][1], begins, atol=0.02)
    lab.run(9.0)
    assert lab.mode == Mode.ACTIVE
    lab.run(1.5)  # this policy only lies there
    assert [f.id for f in lab.core.state.faults] == ["S7"]


@pytest.mark.slow
@pytest.mark.parametrize("name", SIGNALS)
def test_processes_that_die(hand_model, marching_dir, name):
    for seed in range(5):
        death = kill_one(hand_model, marching_dir, name, seed)
        assert death.safe and death.reaction_s <= WITHIN_S[name.split()[0]]


def test_a_supervisor_that_ends_by_an_error_of_its_own_leaves_a_safe_hand(
    hand_model, marching_dir
):
    interface = load_bundle(marching_dir).manifest.interface
    lines = []
    with SimulatorProcess(hand_model, interface, lifetime_s=60.0) as simulator:
        options = plain_options(marching_dir, simulator.path, None, wiggle=["joint"])
        launcher = Launcher(options, lines.append)
        while launcher.poll(0.2):
            launcher.send("arm")
        assert launcher.finish() == EXIT_TRIP
    assert "the supervisor died (an error of its own)" in lines
    assert lines[-1] == "guard: de-energized, confirmed"


def test_a_supervisor_that_is_killed_leaves_a_safe_hand(hand_model, marching_dir):
    death = kill_one(hand_model, marching_dir, "S13 supervisor killed (SIGKILL)", 0)
    assert death.safe
