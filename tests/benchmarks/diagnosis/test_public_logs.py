"""Adapters of public data: on small files of the same format, and on the real ones.

The real files are not part of the project; FINGERS_REAL_DATA names the folder that has
them as `emps`, `bam_xl330/raw` and `sts3215_backlash/logs`.
"""

import json
import os
from pathlib import Path

import numpy as np
import pytest
import scipy.io

from benchmarks.diagnosis.public_logs.emps import FILES, load_emps
from benchmarks.diagnosis.public_logs.sts3215 import RAD_PER_COUNT, load_sts3215
from benchmarks.diagnosis.public_logs.xl330 import load_xl330
from envs.errors import InputError
from sysid.logs.timing import timing

REAL = os.environ.get("FINGERS_REAL_DATA", "")
real = pytest.mark.skipif(not REAL, reason="FINGERS_REAL_DATA names no folder")


def emps_files(folder, **changes):
    column = np.arange(5.0)[:, None]
    data = {"t": column * 1e-3, "qm": column * 1e-2, "qg": column * 2e-2, "vir": column}
    data |= {"gtau": [[35.0]], "kp": [[160.0]], "kv": [[243.0]], **changes}
    scipy.io.savemat(folder / FILES[0], data)
    scipy.io.savemat(folder / FILES[1], {**data, "pulses_N": column})


def test_emps(tmp_path):
    emps_files(tmp_path)
    fit, check = load_emps(tmp_path)
    assert fit.column("tau.axis").tolist() == [0.0, 35.0, 70.0, 105.0, 140.0]
    assert fit.header.units == {"cmd": "m", "pos": "m", "tau": "N"}
    assert fit.column("cmd.axis")[1] == 2.0 * fit.column("pos.axis")[1]
    assert fit.header.settings == {"gtau": 35.0, "kp": 160.0, "kv": 243.0}
    assert "ext.axis" not in fit.columns
    assert check.column("ext.axis").tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]


def test_emps_that_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"DATA_EMPS\.mat"):
        load_emps(tmp_path)
    emps_files(tmp_path, qm=np.array([["a"]]))
    with pytest.raises(InputError, match=r"DATA_EMPS\.mat"):
        load_emps(tmp_path)
    scipy.io.savemat(tmp_path / FILES[0], {"t": [0.0]})
    with pytest.raises(InputError, match="no qm, qg, vir"):
        load_emps(tmp_path)


def xl330_record():
    entry = {"position": 0.1, "speed": 0.0, "input_volts": 7.3, "temp": 28}
    loads = ((0.0, 177, True), (0.005, 65536 - 885, True), (0.01, 0, False))
    entries = [
        {
            **entry,
            "timestamp": t,
            "load": load,
            "goal_position": 0.2,
            "torque_enable": on,
        }
        for t, load, on in loads
    ]
    head = {"mass": 0.49, "length": 0.1, "kp": 200, "vin": 7.4, "trajectory": "sin"}
    return {**head, "entries": entries}


def test_xl330(tmp_path):
    (tmp_path / "b.json").write_text(json.dumps(xl330_record()))
    (tmp_path / "a.json").write_text(json.dumps({**xl330_record(), "kp": 100}))
    first, second = load_xl330(tmp_path)
    assert (first.header.settings["kp"], second.header.settings["kp"]) == (100.0, 200.0)
    assert first.column("duty.servo") == pytest.approx([0.2, -1.0, 0.0])
    assert first.missing("cmd.servo").tolist() == [False, False, True]
    assert (first.header.load.mass_kg, first.header.load.lever_m) == (0.49, 0.1)


@pytest.mark.parametrize(
    "text", ["{", "[]", "3", '{"entries": [1]}', '{"entries": []}']
)
def test_xl330_that_is_refused(tmp_path, text):
    with pytest.raises(InputError, match=r"no \.json file"):
        load_xl330(tmp_path)
    (tmp_path / "a.json").write_text(text)
    with pytest.raises(InputError, match=r"a\.json"):
        load_xl330(tmp_path)


FIELDS = ("target pos", "pos", "speed", "load", "current", "temp", "status", "moving")
ROWS = (
    "2025-11-12T10:03:29.555Z,1947,,,,,,,,,,,,,,,",
    "2025-11-12T10:03:29.656Z,1947,2037,32968,1174,2,35,0,1,,,,,,,,",
)


def sts_file(folder, *rows):
    names = [f"{field} ({motor})" for motor in (1, 2) for field in FIELDS]
    file = folder / "log.csv"
    file.write_text("\n".join([",".join(["timestamp", *names]), *rows]) + "\n")
    return file


def test_sts3215(tmp_path):
    log = load_sts3215(sts_file(tmp_path, *ROWS))
    assert log.header.joints == ("motor1",)
    assert log.t_s == pytest.approx([0.0, 0.101])
    assert log.column("cmd.motor1") == pytest.approx([-100 * RAD_PER_COUNT] * 2)
    assert log.missing("pos.motor1").tolist() == [True, False]
    assert log.column("pos.motor1")[1] == pytest.approx(-10 * RAD_PER_COUNT)
    assert log.column("vel.motor1")[1] == pytest.approx(-200 * RAD_PER_COUNT)
    assert log.column("duty.motor1")[1] == pytest.approx(0.150)
    assert log.column("cur.motor1")[1] == pytest.approx(0.013)


@pytest.mark.parametrize(
    ("rows", "match"),
    [
        (("yesterday" + ROWS[0][24:], ROWS[1]), "timestamp"),
        ((ROWS[0], ROWS[1] + ",1"), "line 3: found 18 cells"),
        ((ROWS[0], ROWS[1].replace("2037", "x")), "line 3: found x"),
        ((ROWS[0], ROWS[0]), "columns"),
        ((), "columns"),
    ],
)
def test_sts3215_that_is_refused(tmp_path, rows, match):
    with pytest.raises(InputError, match=match):
        load_sts3215(sts_file(tmp_path, *rows))


def test_a_motor_that_the_file_lacks_is_refused(tmp_path):
    with pytest.raises(InputError, match="motors: found 3"):
        load_sts3215(sts_file(tmp_path, *ROWS), motors=["3"])


@real
def test_real_emps():
    """The published model, found again by least squares of the inverse dynamics."""
    fit, check = load_emps(Path(REAL) / "emps")
    assert len(fit) == len(check) == 24_841
    assert timing(fit.t_s).regular
    q = np.convolve(
        fit.column("pos.axis"), np.hanning(41) / np.hanning(41).sum(), "same"
    )
    v = np.gradient(q, 1e-3)
    a = np.gradient(v, 1e-3)
    inner = slice(200, -200)
    basis = np.stack([a, v, np.sign(v), np.ones_like(v)], 1)[inner]
    found = np.linalg.lstsq(basis, fit.column("tau.axis")[inner], rcond=None)[0]
    assert found[:3] == pytest.approx([95.11, 203.5, 20.39], rel=0.05)


@real
def test_real_xl330():
    """The controller's gain is half of what the manual says, kp / 128."""
    logs = load_xl330(Path(REAL) / "bam_xl330/raw")
    assert [log.header.settings["kp"] for log in logs] == [100] * 4 + [200] * 4 + [
        400
    ] * 4 + [800] * 4
    ratios = []
    for log in logs[:4]:
        error = log.column("cmd.servo") - log.column("pos.servo")
        counts = error[1:] * 4096 / (2 * np.pi) * log.header.settings["kp"] / 128
        duty, known = log.column("duty.servo")[1:] * 885, ~np.isnan(error[1:])
        ratios.append(np.sum(duty[known] * counts[known]) / np.sum(counts[known] ** 2))
    assert np.mean(ratios) == pytest.approx(0.5, abs=0.02)


@real
def test_real_sts3215():
    files = sorted((Path(REAL) / "sts3215_backlash/logs").glob("*.csv"))
    assert len(files) == 5
    for log in map(load_sts3215, files):
        assert timing(log.t_s).period_s == pytest.approx(0.1, abs=0.005)
        for joint in log.header.joints:
            assert np.nanmax(np.abs(log.column(f"duty.{joint}"))) <= 1.0
