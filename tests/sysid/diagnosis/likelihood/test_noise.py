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
from sysid.diagnosis.likelihood.noise_floor import difference_noise
from sysid.diagnosis.likelihood.whitening import bulk_deviation
from sysid.diagnosis.measured.resampling import SMOOTH_STEPS, smoothed
from sysid.diagnosis.replay.band import BAND_STEPS, EVERY
from sysid.diagnosis.replay.noise import band_noise, reading_noise
from sysid.diagnosis.replay.track import all_tracks
from sysid.diagnosis.search.judge import Judge
from sysid.diagnosis.search.search import Search
from sysid.diagnosis.search.settling import settled
from sysid.diagnosis.verdict.observability import blind_effects
from sysid.drive import JointDrive, Nominal
from sysid.logs.log import make_log


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
    return blind_effects(
        Search(problem, base, base, {}, {}, [], samples, Judge(problem, base))
    )


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


@pytest.mark.parametrize("order", [0, 2])
def test_the_noise_of_a_residual_is_known_without_repeats(order):
    """Behind the band, beside an effect that is larger by far and moves slowly."""
    rng = np.random.default_rng(7)
    width = np.hypot(BAND_STEPS, SMOOTH_STEPS)
    y = smoothed(rng.normal(size=40_000), width, order)[::EVERY]
    y = y / y.std()
    t = np.arange(len(y))
    effect = 30.0 * np.sin(2.0 * np.pi * t / 100.0) + 50.0 * (t % 500 < 3)
    variances = np.zeros(3)
    variances[order] = 0.01  # much less than there is
    series, valid = (y + effect)[:, None], np.ones((len(y), 1), bool)
    found = difference_noise(series, valid, variances)
    assert found == pytest.approx(1.0, rel=0.12)
    assert difference_noise(effect[:, None], valid, variances) < 0.25  # control


def test_a_floor_is_at_least_that_of_the_readings_and_at_most_the_residual():
    rng = np.random.default_rng(8)
    series = rng.normal(size=(4000, 1))
    valid = np.ones_like(series, bool)
    assert difference_noise(series, valid, np.array([0.81, 0.0, 0.0])) >= 0.9
    most = bulk_deviation(series[:, 0])
    assert difference_noise(series, valid, np.array([100.0, 0.0, 0.0])) == most


@pytest.mark.parametrize("residue", [0.0, 1e-16])
def test_a_coarse_encoder_has_the_noise_of_its_step(residue):
    """Also where the last digits of equal readings differ."""
    rng = np.random.default_rng(9)
    t_s = np.arange(0.0, 20.0, 0.005)
    angle = np.round(0.5 * np.sin(t_s) / 0.01) * 0.01 + residue * rng.normal(
        size=t_s.size
    )
    log = make_log(("a",), t_s, {"cmd.a": angle, "pos.a": angle})
    drive = JointDrive(Nominal(1.0), Nominal(0.1), effort="none")
    found, _ = reading_noise([log], "a", drive, 0.005)
    assert found == pytest.approx(0.01 / np.sqrt(12.0), rel=0.05)
