"""Whatever file it is given, the command ends in one sentence (F1 to F3).

Damaged logs go through `fingers sysid info` as a user would give them: exit status 0
or 2, one line on stderr, nothing else raised, no hang, bounded memory, and no file
opened outside the log's folder.
"""

import resource
import secrets
import shutil
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
import yaml
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore
from support.log_damage import HOSTILE, csv_damage, flipped, torn
from support.sysid_logs import small_log

from fingers_mjx.cli.main import main
from sysid.logs.read import read_log, write_log

FEW, MANY = 100, 3000
SLOWEST_S, MOST_BYTES = 10.0, 1 << 30
OPENED: list[str] = []
WATCHING: list[bool] = []


def _audited(event, arguments):
    if WATCHING and event in ("open", "sqlite3.connect"):
        OPENED.append(str(arguments[0]))


sys.addaudithook(_audited)


@contextmanager
def watched():
    """Gathers names of files that are opened."""
    OPENED.clear()
    WATCHING.append(True)
    try:
        yield OPENED
    finally:
        WATCHING.clear()


def ends_well(capsys, path, inside: Path) -> bool:
    """Passes a log to the command and returns whether it was refused."""
    began, before = time.process_time(), _most_bytes()
    with watched() as opened:
        status = main(["sysid", "info", str(path)])
    out, err = capsys.readouterr()
    assert status in (0, 2)
    assert time.process_time() - began < SLOWEST_S
    assert _most_bytes() - before < MOST_BYTES
    if status == 2:
        assert err.count("\n") == 1
        assert path.name in err
        assert "sha256" not in out
    else:
        assert err == ""
    assert [name for name in opened if _foreign(name, inside)] == []
    return status == 2


def _most_bytes() -> int:
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def _foreign(name: str, inside: Path) -> bool:
    """Whether a file is neither the log's nor Python's own nor the system's."""
    if name.isdigit():  # a descriptor that is open already
        return False
    file = Path(name).resolve()
    root = Path(__file__).parents[3]
    own = (Path(sys.prefix), Path(sys.base_prefix), root, Path("/sys"), Path("/proc"))
    return not any(file.is_relative_to(p.resolve()) for p in (inside, *own))


def drawn_seed() -> int:
    seed = secrets.randbelow(2**31)
    print(f"seed {seed}")
    return seed


def fuzz_csv(tmp_path, capsys, count):
    rng = np.random.default_rng(drawn_seed())
    file = tmp_path / "home" / "x.csv"
    file.parent.mkdir()
    write_log(small_log(20), file)
    assert not ends_well(capsys, file, file.parent)
    text, refused = file.read_text(), 0
    for _ in range(count):
        file.write_bytes(csv_damage(text, rng))
        refused += ends_well(capsys, file, file.parent)
    assert refused > 0.5 * count


def fuzz_parquet(tmp_path, capsys, count):
    """A flipped bit is refused, or what is read is what was written."""
    rng = np.random.default_rng(drawn_seed())
    file = tmp_path / "home" / "x.parquet"
    file.parent.mkdir()
    write_log(small_log(20), file)
    whole, digest, refused = file.read_bytes(), read_log(file).sha256, 0
    for i in range(count):
        file.write_bytes(torn(whole, rng) if i % 2 else flipped(whole, rng))
        if ends_well(capsys, file, file.parent):
            refused += 1
        else:
            assert read_log(file).sha256 == digest
    assert refused > 0.5 * count


def make_bag(folder: Path, plugin: StoragePlugin) -> Path:
    types = get_typestore(Stores.ROS2_HUMBLE)
    kind, made = "sensor_msgs/msg/JointState", types.types
    with Writer(folder, version=9, storage_plugin=plugin) as writer:
        topics = ("/joint_commands", "/joint_states")
        for topic in topics:
            connection = writer.add_connection(topic, kind, typestore=types)
            for i in range(20):
                time_ = made["builtin_interfaces/msg/Time"](1, 10_000_000 * i)
                header = made["std_msgs/msg/Header"](time_, "palm")
                angle, none = np.array([0.01 * i]), np.array([])
                message = made[kind](header, ["knee"], angle, none, none)
                sent = types.serialize_cdr(message, kind)
                writer.write(connection, 10**9 + 10_000_000 * i, sent)
    return folder


def fuzz_bags(tmp_path, capsys, count):
    rng = np.random.default_rng(drawn_seed())
    for plugin in StoragePlugin:
        bag = make_bag(tmp_path / f"home_{plugin.value}", plugin)
        assert not ends_well(capsys, bag, bag)
        refused, files = 0, sorted(bag.iterdir())
        for i in range(count // 2):
            file = files[i % len(files)]
            whole = file.read_bytes()
            file.write_bytes(torn(whole, rng) if i % 3 else flipped(whole, rng))
            refused += ends_well(capsys, bag, bag)
            file.write_bytes(whole)
        assert refused > 0.25 * count // 2
        (first, *_) = files
        if first.suffix == ".mcap":
            whole = first.read_bytes()
            for _ in range(count // 4):
                first.write_bytes(torn(whole, rng))
                ends_well(capsys, first, bag)


def test_damaged_csv(tmp_path, capsys):
    fuzz_csv(tmp_path, capsys, FEW)


def test_damaged_parquet(tmp_path, capsys):
    fuzz_parquet(tmp_path, capsys, FEW)


def test_damaged_bags(tmp_path, capsys):
    fuzz_bags(tmp_path, capsys, FEW)


@pytest.mark.slow
@pytest.mark.parametrize("fuzz", [fuzz_csv, fuzz_parquet, fuzz_bags])
def test_many_damaged_logs(tmp_path, capsys, fuzz):
    fuzz(tmp_path, capsys, MANY)


def test_a_cell_of_ten_million_characters(tmp_path, capsys):
    file = tmp_path / "x.csv"
    write_log(small_log(20), file)
    text = file.read_text()
    file.write_text(text[: text.rindex(",") + 1] + "1" * 10_000_000 + "\n")
    assert ends_well(capsys, file, tmp_path)


@pytest.mark.parametrize("plugin", list(StoragePlugin))
@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_list_of_files(tmp_path, capsys, plugin, name):
    """A metadata.yaml that leads out of the folder is refused, nothing is opened."""
    bag = make_bag(tmp_path / "bag", plugin)
    (data,) = (file for file in bag.iterdir() if file.suffix != ".yaml")
    shutil.copy(data, tmp_path / "outside.mcap")
    meta = bag / "metadata.yaml"
    listed = yaml.safe_load(meta.read_text())
    listed["rosbag2_bagfile_information"]["relative_file_paths"] = [name]
    meta.write_text(yaml.safe_dump(listed))
    assert ends_well(capsys, bag, bag)


def test_a_bag_without_metadata(tmp_path, capsys):
    bag = make_bag(tmp_path / "bag", StoragePlugin.MCAP)
    (bag / "metadata.yaml").unlink()
    assert ends_well(capsys, bag, bag)


@pytest.mark.parametrize("name", ["x.csv", "x.parquet"])
def test_the_watch_sees_what_lies_outside(tmp_path, capsys, name):
    """Negative control."""
    (tmp_path / "home").mkdir()
    write_log(small_log(20), tmp_path / name)
    with pytest.raises(AssertionError):
        ends_well(capsys, tmp_path / name, tmp_path / "home")
