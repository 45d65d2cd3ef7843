import os

import numpy as np
import pytest
from support.sysid_logs import small_log

from envs.errors import InputError
from sysid.logs.log import MeasuredLog
from sysid.logs.read import read_log, write_log

GOOD = """\
# joints: [knee]
# units: {cmd: rad, pos: rad}
t,cmd.knee,pos.knee
0.0,0.1,0.2
0.01,0.1,
"""


def same(a, b):
    return (
        a.sha256 == b.sha256
        and a.header == b.header
        and all(np.array_equal(a.columns[k], v, True) for k, v in b.columns.items())
        and np.array_equal(a.t_s, b.t_s)
    )


def keys(log):
    return np.array([]) if log.key is None else log.key


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_a_log_reads_back_exactly(tmp_path, suffix):
    log = small_log()
    key = np.array(['A,"b"'] + [""] * 49)
    for written in (log, MeasuredLog(log.header, log.t_s, log.columns, key)):
        write_log(written, tmp_path / f"x{suffix}")
        read = read_log(tmp_path / f"x{suffix}")
        assert same(read, written)
        assert np.array_equal(keys(read), keys(written))
    assert keys(read)[0] == key[0]
    assert [p.name for p in tmp_path.iterdir()] == [f"x{suffix}"]


def test_header_of_a_csv_may_lie_beside_it(tmp_path):
    file = tmp_path / "x.csv"
    lines = GOOD.splitlines(keepends=True)
    file.write_text("".join(lines[2:]))
    with pytest.raises(InputError, match=r"in x\.yaml beside it"):
        read_log(file)
    (tmp_path / "x.yaml").write_text("".join(line[2:] for line in lines[:2]))
    log = read_log(file)
    assert log.missing("pos.knee").tolist() == [False, True]


@pytest.mark.parametrize(
    ("old", "new", "match"),
    [
        ("0.01,0.1,", "0.01,0.1", "line 5: found 2 cells; valid: 3 cells"),
        ("0.01,0.1,", "0.01,x,", "line 5: found x"),
        ("0.01,0.1,", "now,0.1,", "line 5: found now"),
        ("0.01,0.1,", ",0.1,", "t: found nan in row 2"),
        ("0.01,0.1,", "0.01,inf,1", "cmd.knee: found infinity"),
        ("0.01,0.1,\n", "", "t: found 1 rows"),
        ("t,cmd", "time,cmd", "a column t"),
        ("pos.knee\n", "cmd.knee\n", "cmd.knee twice"),
        ("pos: rad", "pos: deg", "units.pos: found deg"),
        ("joints: [knee]", "joints: 3", "joints"),
        ("joints: [knee]", "joins: [knee]", "joins"),
        ("joints: [knee]", "joints: [knee", "strict YAML"),
        ("0.1,0.2", "90,88", "are the values in rad"),
        (GOOD, "", "no row of column names"),
        (GOOD, "# a\n" * 2000, "no row of column names"),
        (GOOD, "\udcff", "UTF-8"),
    ],
)
def test_csv_that_is_refused_in_one_sentence(tmp_path, old, new, match):
    file = tmp_path / "x.csv"
    assert old in GOOD
    file.write_bytes(GOOD.replace(old, new).encode("utf-8", "surrogateescape"))
    with pytest.raises(InputError, match=match) as caught:
        read_log(file)
    assert "x.csv" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_parquet_that_is_refused(tmp_path):
    import pyarrow as pa
    import pyarrow.parquet as pq

    file = tmp_path / "x.parquet"
    write_log(small_log(), file)
    table = pq.read_table(file)
    meta = table.schema.metadata

    def refused(match, changed):
        pq.write_table(changed, file)
        with pytest.raises(InputError, match=match):
            read_log(file)

    refused("metadata fingers.measured_log", table.replace_schema_metadata({}))
    for text in (b"{", b"[" * 100_000, b"\xff"):
        refused("JSON", table.replace_schema_metadata({next(iter(meta)): text}))
    refused("a column t", table.drop(["t"]))
    words = pa.array(["a"] * 50)
    refused(
        "pos.hip: found string", table.drop(["pos.hip"]).append_column("pos.hip", words)
    )
    refused("key: found int", table.append_column("key", pa.array([1] * 50)))


def test_damaged_files_never_end_in_another_error(tmp_path):
    """Truncated at and flipped in random places, both formats."""
    rng = np.random.default_rng(seed := 11)
    for suffix in (".csv", ".parquet"):
        file = tmp_path / f"x{suffix}"
        write_log(small_log(), file)
        whole, refused = file.read_bytes(), 0
        for _ in range(100):
            data = bytearray(whole[: rng.integers(0, len(whole) + 1)])
            for place in rng.integers(0, len(data), 3) if data else ():
                data[place] = rng.integers(0, 256)
            file.write_bytes(data)
            try:
                read_log(file)
            except InputError:
                refused += 1
        assert refused > 50, (seed, suffix)


def test_names_that_are_no_log(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        read_log(tmp_path / "x.csv")
    (tmp_path / "x.txt").write_text(GOOD)
    with pytest.raises(InputError, match=r"found \.txt"):
        read_log(tmp_path / "x.txt")
    with pytest.raises(InputError, match=r"found \.db3"):
        write_log(small_log(), tmp_path / "x.db3")


@pytest.mark.parametrize("suffix", [".csv", ".parquet", ".mcap"])
@pytest.mark.parametrize("target", ["pipe", "/dev/zero"])
def test_a_special_file_is_refused_at_once(tmp_path, suffix, target):
    os.mkfifo(tmp_path / "pipe")
    path = tmp_path / f"log{suffix}"
    path.symlink_to(target)
    with pytest.raises(InputError, match=r"found a (named pipe|device)"):
        read_log(path)


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ("t," + ",".join(f"c{k}" for k in range(20_000)) + "\n", "20001 columns"),
        ("t" + "," * 1_000_000 + "\n", "a longer line"),
        ("t,cmd.knee\n" + ",\n" * 13_000_000, "more cells"),
        ("t,cmd.knee,pos.knee\n" + "1" * 300_000 + "\n", "field larger"),
    ],
)
def test_a_table_that_takes_too_much_is_refused_before_it_is_parsed(
    tmp_path, body, words
):
    path = tmp_path / "log.csv"
    path.write_text(body)
    with pytest.raises(InputError, match=words):
        read_log(path)


def test_a_line_that_is_long_across_parts_is_found(tmp_path, monkeypatch):
    monkeypatch.setattr("sysid.logs.csv_file._PART", 1000)
    path = tmp_path / "log.csv"
    path.write_text(GOOD + "a" * 300_000)
    with pytest.raises(InputError, match="a longer line"):
        read_log(path)
    path.write_text(GOOD + "0.02,0.1,0.2\n" * 3000)
    assert len(read_log(path)) == 3002
