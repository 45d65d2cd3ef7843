"""Noise behind the whitening filter, limits out of reach, what hidden cases show."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.diagnosis.hidden.believed import believed
from benchmarks.diagnosis.hidden.cases import _Finder, draw_case
from benchmarks.diagnosis.hidden.recording import standard
from benchmarks.diagnosis.hidden.sampling import Noise
from benchmarks.diagnosis.hidden.stands import make_stand, slightly_wrong
from sysid.diagnosis.diagnose import problem_of
from sysid.diagnosis.measured.resampling import SMOOTH_STEPS, smoothed
from sysid.diagnosis.replay.band import BAND_STEPS, EVERY
from sysid.diagnosis.replay.noise import band_noise
from sysid.diagnosis.replay.track import all_tracks
from sysid.diagnosis.search.search import Search, settled
from sysid.diagnosis.verdict.observability import blind_effects


@pytest.mark.parametrize("whitening", [(), (0.56, -0.2, 0.15, -0.1)])
def test_noise_is_as_large_as_the_filters_leave_it(whitening):
    rng = np.random.default_rng(5)
    width = np.hypot(BAND_STEPS, SMOOTH_STEPS)
    x = rng.normal(0.0, 2.0, 400_000)
    found = []
    for order in range(3):
        y = smoothed(x, width, order)[::EVERY] / 0.005**order
        white = y.copy()
        for k, a in enumerate(whitening, 1):
            white[k:] -= a * y[:-k]
        found.append(white[8:-8].std())
    expected = band_noise((2.0, 2.0), 0.005, whitening)
    assert expected[:3] == pytest.approx(found, rel=0.02)
    assert expected[3] == expected[0]


def blind(case, limit_nm=None):
    """Effects that are reported as not observable."""
    mechanism = believed(case.stand)
    if limit_nm is not None:
        drive = mechanism.drives[case.joint]
        figure = replace(drive.effects["torque_limit"]["limit_nm"], value=limit_nm)
        effects = {**drive.effects, "torque_limit": {"limit_nm": figure}}
        drives = {case.joint: replace(drive, effects=effects)}
        mechanism = replace(mechanism, drives=drives)
    logs = list(case.logs)
    problem = problem_of(all_tracks(logs, mechanism)[0], logs, mechanism, False)
    problem, base = settled(problem)
    samples = int(problem.counts().sum())
    return blind_effects(Search(problem, base, base, {}, {}, samples))


def most_nm(case) -> float:
    return float(np.nanmax(np.abs(case.logs[0].columns[f"tau.{case.joint}"])))


def test_a_limit_that_no_motion_reaches_is_not_observable():
    case = draw_case(5, ("torque_limit",), "invisible", round_s=6.0)
    hidden = case.truth.joints[0].effects["torque_limit"]["limit_nm"]
    assert most_nm(case) < hidden < case.stand.mechanism.joints[0].limit_nm
    assert "torque_limit" in blind(case)
    assert "torque_limit" in blind(case, 1.03 * most_nm(case))


def test_a_limit_that_acts_is_observable():
    case = draw_case(17, round_s=6.0)
    assert most_nm(case) > 0.98 * case.truth.joints[0].limit_nm
    assert "torque_limit" not in blind(case)


@pytest.mark.parametrize(("settled_s", "visible"), [(0.5, False), (-1.0, True)])
def test_how_a_joint_begins_makes_nothing_visible(monkeypatch, settled_s, visible):
    """A light joint does not feel where its encoder's zero is."""
    monkeypatch.setattr("benchmarks.diagnosis.hidden.cases.SETTLED_S", settled_s)
    rng = np.random.default_rng(4)
    stand = make_stand("joint", rng)
    once = standard(rng, stand.middle, stand.reach, 200.0, 4.0)
    joint = int(np.argmax(stand.reach))
    base = slightly_wrong(stand.mechanism, rng)
    find = _Finder(stand, base, joint, "encoder_offset", once, Noise(), 1)
    assert (find.ratio(0.01) > 1.05) == visible
