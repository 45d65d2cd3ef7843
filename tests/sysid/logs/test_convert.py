"""Logs go from every format to every other and come back to the bit."""

import json

import numpy as np
import pytest

from envs.errors import InputError
from fingers_mjx.cli.main import main
from sysid.logs.lerobot import read_lerobot
from sysid.logs.log import Load, LogHeader, MeasuredLog
from sysid.logs.read import read_log, write_log

FORMATS = ("csv", "parquet", "mcap", "bag", "lerobot")
UNITS = {"cmd": "rad", "pos": "rad", "cur": "A", "gyro": "rad/s", "supply": "V"}


def rich(t_s=None):
    """Two joints, missing readings, key events, quantities that ROS lacks."""
    rng = np.random.default_rng(4)
    t_s = 0.3 + np.arange(20) * 0.01 if t_s is None else t_s
    names = [
        "cmd.knee",
        "cmd.hip",
        "pos.knee",
        "pos.hip",
        "cur.hip",
        "gyro.y",
        "supply",
    ]
    columns = {name: rng.normal(size=len(t_s)) for name in names}
    columns["pos.hip"][3] = columns["supply"][5:] = np.nan
    key = np.array(["", "left"] * (len(t_s) // 2))
    header = LogHeader(
        ("knee", "hip"), UNITS, load=Load(0.5, 0.1), settings={"kp": 2.0}, note="eins"
    )
    return MeasuredLog(header, t_s, columns, key)


def place(tmp_path, kind):
    folder = kind in ("bag", "lerobot")
    return tmp_path / (kind if folder else f"log.{kind}"), kind if folder else None


@pytest.mark.parametrize("kind", FORMATS)
def test_a_log_comes_back_to_the_bit(tmp_path, kind):
    log, (path, folder) = rich(), place(tmp_path, kind)
    write_log(log, path, folder)
    found = read_log(path)
    assert found.sha256 == log.sha256 and found.header == log.header
    assert sorted(tmp_path.iterdir()) == [path]


def test_the_command_converts_along_a_chain(tmp_path, capsys):
    log = rich()
    before = tmp_path / "first.csv"
    write_log(log, before)
    for kind in ("lerobot", "mcap", "bag", "parquet"):
        after, folder = place(tmp_path, kind)
        words = [] if folder is None else ["--to", folder]
        assert main(["log", "convert", str(before), str(after), *words]) == 0
        before = after
    assert read_log(before).sha256 == log.sha256
    assert "20 rows, 7 columns" in capsys.readouterr().out


@pytest.mark.parametrize("kind", ["mcap", "bag"])
def test_other_tools_find_joint_states(tmp_path, kind):
    from sysid.logs.bag import BagMap

    path, folder = place(tmp_path, kind)
    write_log(rich(), path, folder)
    log = read_log(path, BagMap())
    assert log.header.joints == ("knee", "hip")
    _, values = log.samples("cmd.knee")
    assert np.array_equal(values, rich().columns["cmd.knee"])


def test_uneven_rows_are_no_lerobot_dataset(tmp_path):
    uneven = rich(np.array([0.0, 0.01, 0.03, 0.04]))
    with pytest.raises(InputError, match=r"t: found a row .* s off an even rate"):
        write_log(uneven, tmp_path / "set", "lerobot")
    assert list(tmp_path.iterdir()) == []


def test_a_dataset_of_others_needs_a_header(tmp_path, capsys):
    path = tmp_path / "set"
    write_log(rich(), path, "lerobot")
    file = path / "meta/info.json"
    info = json.loads(file.read_text("utf-8"))
    del info["fingers_measured_log"]
    file.write_text(json.dumps(info), "utf-8")
    with pytest.raises(InputError, match="--header FILE"):
        read_log(path)
    header = LogHeader(("knee", "hip"), {"cmd": "rad", "pos": "rad"})
    log = read_lerobot(path, header)
    assert np.array_equal(log.columns["pos.knee"], rich().columns["pos.knee"])
    with pytest.raises(InputError, match="episode: found 3"):
        read_lerobot(path, header, 3)


@pytest.mark.parametrize(
    ("argv", "said"),
    [
        (["nothing.csv", "x.parquet"], "nothing.csv"),
        (["log.csv", "x.xls"], ".xls"),
        (["log.csv", "there", "--to", "bag"], "something that exists"),
    ],
)
def test_what_cannot_be_converted_is_named(tmp_path, monkeypatch, capsys, argv, said):
    monkeypatch.chdir(tmp_path)
    write_log(rich(), "log.csv")
    (tmp_path / "there").mkdir()
    assert main(["log", "convert", *argv]) == 2
    found = capsys.readouterr().err
    assert said in found and found.count("\n") == 1


def test_damage_is_refused(tmp_path):
    import pyarrow.parquet

    write_log(rich(), tmp_path / "set", "lerobot")
    (file,) = (tmp_path / "set/data").rglob("*.parquet")
    table = pyarrow.parquet.read_table(file)
    times = [0.3 + 0.011 * i for i in range(20)]
    place = table.column_names.index("observation.t_s")
    changed = table.set_column(place, "observation.t_s", pyarrow.array(times))
    pyarrow.parquet.write_table(changed, file)
    with pytest.raises(InputError, match="other contents"):
        read_log(tmp_path / "set")
