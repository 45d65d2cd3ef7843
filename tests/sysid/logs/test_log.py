import numpy as np
import pytest
from support.sysid_logs import small_log

from envs.errors import InputError
from sysid.logs.log import LogHeader, MeasuredLog, make_log
from sysid.logs.timing import timing

ROWS = 4
T = np.arange(ROWS) * 0.01
ZERO = np.zeros(ROWS)
KNEE = {"cmd.knee": ZERO, "pos.knee": ZERO}


def refused(match, columns=KNEE, t_s=T, joints=("knee",), **options):
    with pytest.raises(InputError, match=match) as caught:
        make_log(joints, t_s, columns, source="walk.csv", **options)
    assert "walk.csv" in str(caught.value) or caught.value.source == "log"


def test_a_log_keeps_readings_as_they_were():
    log = small_log()
    assert len(log) == 50
    assert log.missing("tau.knee").sum() == 3
    times, values = log.samples("tau.knee")
    assert len(times) == 47
    assert np.all(np.isfinite(values))


def test_a_log_cannot_be_written_to():
    log = small_log()
    with pytest.raises(ValueError, match="read-only"):
        log.column("pos.knee")[0] = 1.0
    given = ZERO.copy()
    log = make_log(("knee",), T, {"cmd.knee": given, "pos.knee": ZERO})
    given[0] = 1.0
    assert log.column("cmd.knee")[0] == 0.0


def test_digest_follows_contents_only():
    log = small_log()
    assert log.sha256 == small_log().sha256
    assert log.sha256 == small_log(source="other").sha256
    moved = {k: v + (k == "pos.hip") * 1e-12 for k, v in log.columns.items()}
    others = [
        small_log(note="x"),
        MeasuredLog(log.header, log.t_s, moved),
        MeasuredLog(log.header, log.t_s + 1e-9, log.columns),
        MeasuredLog(log.header, log.t_s, log.columns, np.array(["a"] * 50)),
    ]
    assert len({log.sha256, *(other.sha256 for other in others)}) == 5


@pytest.mark.parametrize(
    ("columns", "match"),
    [
        ({**KNEE, "pos.kne": ZERO}, r"pos.kne; valid: one of .*did you mean pos\.knee"),
        ({"cmd.knee": ZERO}, "no pos.knee"),
        ({**KNEE, "pos.knee": ZERO[:-1]}, "pos.knee: found 3 values; valid: 4"),
        ({**KNEE, "pos.knee": ZERO + np.inf}, "pos.knee: found infinity"),
        ({**KNEE, "pos.knee": ZERO + np.nan}, "pos.knee: found no reading"),
        ({**KNEE, "cmd.knee": ZERO + 90.0}, "cmd.knee: found 90; .*are the values in"),
        ({**KNEE, "vel.knee": np.zeros((ROWS, 2))}, r"vel.knee: found shape \(4, 2\)"),
    ],
)
def test_columns_that_are_refused(columns, match):
    refused(match, columns)


def test_headers_that_are_refused():
    refused("joints: found ..; valid: at least one", joints=(), columns={})
    refused("joints", joints=("knee", "knee"))
    refused("units.pos: found deg; valid: rad or m", units={"pos": "deg"})
    refused("units.tau: found tau; valid", units={"tau": "N·m"})
    refused("palm_quat_w", palm_quat_w=(1.0, 1.0, 0.0, 0.0))
    refused("schema: found 2", schema=2)
    with pytest.raises(InputError, match=r"units\.cmd: found nothing"):
        MeasuredLog(LogHeader(("knee",), {"pos": "rad"}), T, KNEE)


def test_ascii_spellings_of_units_are_known():
    log = make_log(("knee",), T, {**KNEE, "tau.knee": ZERO}, {"tau": "N*m"})
    assert log.header.units["tau"] == "N·m"


@pytest.mark.parametrize(
    ("t_s", "match"),
    [
        (T[:1], "t: found 1 rows"),
        (np.array([0.0, np.nan, 0.2, 0.3]), "t: found nan in row 2"),
        (np.array([0.0, np.inf, 0.2, 0.3]), "t: found inf in row 2"),
    ],
)
def test_times_that_are_refused(t_s, match):
    columns = {name: values[: len(t_s)] for name, values in KNEE.items()}
    refused(match, columns, t_s)


def test_unknown_column_names_the_nearest():
    with pytest.raises(InputError, match=r"did you mean pos\.knee"):
        small_log().column("pos.kne")


def test_timing_reports_what_is_irregular():
    t_s = np.array([0.0, 1.0, 2.0, 2.0, 3.0, 9.0, 10.0, 4.0, 5.0]) * 0.01
    found = timing(t_s)
    assert found.period_s == pytest.approx(0.01)
    assert (found.repeated.tolist(), found.gaps.tolist()) == ([2], [4])
    assert found.backward.tolist() == [6]
    assert not found.regular
    assert timing(T).regular
    assert timing(T).jitter_s == pytest.approx(0.0, abs=1e-12)
    assert found.parts == [slice(0, 5), slice(5, 7), slice(7, 9)]


def test_jitter_is_the_deviation_of_the_steps():
    rng = np.random.default_rng(0)
    t_s = np.cumsum(0.01 + rng.normal(0.0, 5e-4, 20_000))
    assert timing(t_s).jitter_s == pytest.approx(5e-4, rel=0.03)


def test_a_clock_that_stands_has_no_period():
    with pytest.raises(InputError, match="no step forward"):
        timing(np.ones(5))


def test_missing_rows_make_gaps_in_their_column_only():
    log = small_log()
    assert log.timing("tau.knee").gaps.size == 2
    assert log.timing("pos.knee").gaps.size == 1
    assert log.timing("pos.knee") is log.timing("pos.knee")


def test_resampling_invents_nothing():
    t_s = np.array([0.0, 0.01, 0.02, 0.08, 0.09])
    log = make_log(("knee",), t_s, {"cmd.knee": t_s, "pos.knee": 2.0 * t_s})
    asked = np.array([-0.001, 0.0, 0.005, 0.02, 0.05, 0.085, 0.1])
    found = log.resampled("pos.knee", asked)
    assert np.isnan(found).tolist() == [True, False, False, False, True, False, True]
    assert found[[1, 2, 3, 5]] == pytest.approx([0.0, 0.01, 0.04, 0.17])


def test_resampling_a_backward_clock_is_refused():
    t_s = np.array([0.0, 0.01, 0.02, 0.005])
    log = make_log(("knee",), t_s, KNEE)
    with pytest.raises(InputError, match=r"step back at 0\.02 s"):
        log.resampled("pos.knee", T)
