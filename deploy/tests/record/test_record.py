import time

import numpy as np
import pytest
from rosbags.highlevel import AnyReader

from fingers_deploy.errors import InputError
from fingers_robot.record import read_log
from fingers_robot.record.recorder import Recorder
from fingers_robot.record.row import NAMES, ROW, empty_row, schema_text
from sysid.logs.bag import BagMap
from sysid.logs.read import read_log as read_measured_log

JOINTS = tuple(f"finger{f}_joint{j}" for f in range(1, 6) for j in range(1, 5))


def _random_row(rng, t):
    row = np.frombuffer(rng.bytes(ROW.itemsize), ROW)[0].copy()
    for name in NAMES:
        if row[name].dtype.kind == "f":
            row[name] = rng.standard_normal(row[name].shape)
    row["quat"] /= np.linalg.norm(row["quat"])
    row["t"] = t
    return row


def _record(folder, count, seed=1, **changes):
    rng, start = np.random.default_rng(seed), time.monotonic()
    recorder = Recorder(folder, "run", JOINTS, {"driver": "test"}, start)
    rows = [_random_row(rng, 0.02 * k) for k in range(count)]
    for row in rows:
        recorder.row(start + float(row["t"]), row)
    recorder.event(start + 0.5, "active -> stopping ±")
    recorder.close({"late_max_ms": "1.5"})
    return recorder, np.array(rows)


def test_what_is_written_reads_back_to_the_bit(tmp_path):
    recorder, rows = _record(tmp_path, 300)
    log = read_log(recorder.files[0])
    assert log.rows.tobytes() == rows.tobytes()
    assert log.joint_names == JOINTS and log.complete
    assert log.metadata["driver"] == "test"
    ((when, line),) = log.events
    assert line == "active -> stopping ±" and when == pytest.approx(0.5, abs=0.01)
    columns = log.columns()
    np.testing.assert_array_equal(columns["cmd.finger2_joint3"], rows["cmd"][:, 6])
    np.testing.assert_array_equal(columns["gyro.z"], rows["gyro"][:, 2])
    assert {"t", "pos.finger1_joint1", "cur.finger5_joint4", "gravity.x"} <= set(
        columns
    )


def test_an_independent_reader_agrees(tmp_path):
    recorder, rows = _record(tmp_path, 120)
    with AnyReader([recorder.files[0]]) as reader:
        kinds = {c.topic: c.msgtype for c in reader.connections}
        assert kinds["/fingers/log"] == "fingers_msgs/msg/LogRow"
        read = [
            (stamp, reader.deserialize(raw, c.msgtype))
            for c, stamp, raw in reader.messages()
            if c.topic == "/fingers/log"
        ]
    assert len(read) == 120
    for (stamp, message), row in zip(read, rows, strict=True):
        for name in NAMES:
            np.testing.assert_array_equal(getattr(message, name), row[name])
        assert abs(stamp - read[0][0] - 1e9 * row["t"]) < 1e4


def test_ros_tools_and_sysid_read_the_same_numbers(tmp_path):
    recorder, rows = _record(tmp_path, 60)
    with AnyReader([recorder.files[0]]) as reader:
        found = {}
        for c, _, raw in reader.messages():
            found.setdefault(c.topic, []).append(reader.deserialize(raw, c.msgtype))
    for k, row in enumerate(rows):
        state, command, imu = (
            found[topic][k] for topic in ("/joint_states", "/joint_commands", "/imu")
        )
        assert tuple(state.name) == JOINTS == tuple(command.name)
        np.testing.assert_array_equal(state.position, row["pos"].astype(float))
        np.testing.assert_array_equal(state.effort, row["cur"].astype(float))
        np.testing.assert_array_equal(command.position, row["cmd"].astype(float))
        q, w = imu.orientation, imu.angular_velocity
        np.testing.assert_array_equal([q.w, q.x, q.y, q.z], row["quat"].astype(float))
        np.testing.assert_array_equal([w.x, w.y, w.z], row["gyro"].astype(float))
        assert imu.linear_acceleration_covariance[0] == -1


def test_identification_reads_a_recording_as_it_is(tmp_path):
    recorder, rows = _record(tmp_path, 60)
    log = read_measured_log(recorder.files[0])
    topics = BagMap(imu="/imu", effort="cur", mounting="free")
    assert read_measured_log(recorder.files[0], topics).header == log.header
    assert log.header.mounting == "free" and "tau" not in log.header.units
    assert log.header.joints == JOINTS
    for name, index in (("cmd", 6), ("pos", 6), ("cur", 6)):
        column = log.columns[f"{name}.finger2_joint3"]
        there = ~np.isnan(column)
        np.testing.assert_array_equal(column[there], rows[name][:, index].astype(float))
    gyro = log.columns["gyro.y"]
    np.testing.assert_array_equal(
        gyro[~np.isnan(gyro)], rows["gyro"][:, 1].astype(float)
    )


def test_the_message_definition_has_the_size_of_the_record():
    sizes = {"float64": 8, "float32": 4, "uint32": 4, "uint8": 1}
    total = 0
    for line in schema_text().splitlines():
        if line.startswith("#"):
            continue
        kind, _ = line.split()
        base, _, count = kind.rstrip("]").partition("[")
        assert total % sizes[base] == 0  # no padding in CDR
        total += sizes[base] * int(count or 1)
    assert total == ROW.itemsize


def test_an_empty_row_says_that_nothing_is_known():
    row = empty_row()
    assert np.isnan(row["pos"]).all() and np.isnan(row["supply"])
    assert row["mode"] == 0


def test_a_recording_that_was_cut_off_reads_up_to_its_last_chunk(tmp_path):
    recorder, rows = _record(tmp_path, 300)
    data = recorder.files[0].read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(data[: data.index(b"fingers_summary") - 13])
    log = read_log(cut)
    assert not log.complete
    assert log.rows.tobytes() == rows[: len(log.rows)].tobytes()


def test_flipped_bits_in_the_data_are_found(tmp_path):
    recorder, rows = _record(tmp_path, 200)
    data = recorder.files[0].read_bytes()
    rng, wrong = np.random.default_rng(2), 0
    for place in rng.integers(8, len(data), 300):
        damaged = bytearray(data)
        damaged[place] ^= 1 << int(rng.integers(8))
        path = tmp_path / "damaged.mcap"
        path.write_bytes(bytes(damaged))
        try:
            log = read_log(path)
        except InputError as error:
            assert "\n" not in str(error)
            continue
        # What the checksum does not cover is not data: summary, names, index.
        wrong += log.rows.tobytes() != rows.tobytes() and log.complete
    assert wrong == 0


def test_noise_is_refused_in_one_sentence(tmp_path):
    rng, path = np.random.default_rng(3), tmp_path / "noise.mcap"
    for length in range(0, 400, 7):
        path.write_bytes(b"\x89MCAP0\r\n" + rng.bytes(length))
        with pytest.raises(InputError):
            read_log(path)
    path.write_bytes(b"")
    with pytest.raises(InputError, match="MCAP"):
        read_log(path)
    with pytest.raises(InputError, match="nowhere"):
        read_log(tmp_path / "nowhere")


def test_files_rotate_and_a_log_is_never_written_over(tmp_path, monkeypatch):
    monkeypatch.setattr("fingers_robot.record.recorder.MAX_FILE_BYTES", 20_000)
    recorder, rows = _record(tmp_path, 300)
    assert len(recorder.files) > 3
    assert all(file.stat().st_size < 30_000 for file in recorder.files)
    read = np.concatenate([read_log(file).rows for file in recorder.files])
    assert read.tobytes() == rows.tobytes()
    with pytest.raises(InputError, match="run-000"):
        _record(tmp_path, 1)


def test_no_file_is_larger_than_50_mb(tmp_path):
    """What is written after the last row, indices and summary, counts as well."""
    recorder = Recorder(tmp_path, "run", JOINTS, {}, time.monotonic())
    row = _random_row(np.random.default_rng(0), 0.0)
    for k in range(30_000):
        while recorder._queue.qsize() > 1000:
            time.sleep(0.001)
        recorder.row(0.02 * k, row)
    recorder.close()
    size = recorder.files[0].stat().st_size
    assert recorder.dropped == 0 and 48e6 < size < 50e6


def test_a_full_disk_is_reported_and_stops_nothing(tmp_path, monkeypatch):
    recorder = Recorder(tmp_path, "run", JOINTS, {}, time.monotonic())

    def full(data):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(recorder._writer, "_write", full)
    rng = np.random.default_rng(0)
    deadline = time.monotonic() + 5
    while not recorder.error and time.monotonic() < deadline:
        recorder.row(time.monotonic(), _random_row(rng, 0.0))
        time.sleep(0.002)
    assert "No space" in recorder.error
    recorder.row(time.monotonic(), _random_row(rng, 0.0))
    assert recorder.dropped >= 1
    recorder.close()
