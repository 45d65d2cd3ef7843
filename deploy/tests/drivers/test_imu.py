import struct
import time

import numpy as np
import pytest

from fingers_deploy.errors import InputError
from fingers_deploy.rotations import conjugate, gravity, multiply, tilt, unrotate
from fingers_robot.behaviour.heading import heading
from fingers_robot.drivers.bno085 import Bno085, parse_reports
from fingers_robot.drivers.imu_port import ImuPort

HALF = np.sqrt(0.5)


class Sensor:
    """Gives one sample again and again, or raises."""

    def __init__(self, quat, gyro):
        self.sample, self.error, self.closed = (
            (np.array(quat), np.array(gyro)),
            None,
            False,
        )

    def wait(self):
        time.sleep(0.002)
        if self.error:
            raise self.error
        return self.sample

    def close(self):
        self.closed = True


def _first(port):
    deadline = time.monotonic() + 2
    while port.read() is None and time.monotonic() < deadline:
        time.sleep(0.001)
    return port.read()


def _random_quat(rng):
    q = rng.standard_normal(4)
    return q / np.linalg.norm(q)


def test_mounting_turns_samples_into_the_palm_frame():
    rng = np.random.default_rng(3)
    for _ in range(20):
        palm, mount, rate_b = _random_quat(rng), _random_quat(rng), rng.normal(size=3)
        sensor = Sensor(multiply(palm, mount), unrotate(mount, rate_b))
        port = ImuPort(sensor, tuple(mount))
        sample = _first(port)
        port.close()
        np.testing.assert_allclose(gravity(sample.quat_w), gravity(palm), atol=1e-12)
        np.testing.assert_allclose(sample.gyro_b, rate_b, atol=1e-12)
        # Without the mounting it would be something else.
        assert np.abs(gravity(sensor.sample[0]) - gravity(palm)).max() > 1e-3


def test_a_dead_sensor_raises_and_is_closed():
    sensor = Sensor((1, 0, 0, 0), (0, 0, 0))
    port = ImuPort(sensor, (1.0, 0.0, 0.0, 0.0))
    assert _first(port) is not None
    sensor.error = OSError("no acknowledge")
    time.sleep(0.05)
    with pytest.raises(ConnectionError, match="no acknowledge"):
        port.read()
    port.close()
    assert sensor.closed


@pytest.mark.parametrize("mount", [(1.0, 1.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0), (1.0,)])
def test_a_mounting_that_is_no_rotation_is_refused(mount):
    with pytest.raises(InputError, match="unit quaternion"):
        ImuPort(Sensor((1, 0, 0, 0), (0, 0, 0)), mount)


class Bus:
    """Cargoes waiting on an I²C bus; a read begins with the header again."""

    def __init__(self):
        self.cargoes, self.written, self.closed = [], [], False

    def read(self, count):
        if not self.cargoes:
            return bytes(count)
        cargo = self.cargoes[0]
        if count >= len(cargo):
            self.cargoes.pop(0)
        return cargo[:count].ljust(count, b"\0")

    def write(self, data):
        self.written.append(data)

    def close(self):
        self.closed = True


def _cargo(body, channel=3):
    return struct.pack("<HBB", 4 + len(body), channel, 0) + body


TIME_BASE = b"\xfb" + bytes(4)


def _gyro(x, y, z):
    raw = [round(v * 2**9) for v in (x, y, z)]
    return bytes([0x02, 1, 0, 0]) + struct.pack("<3h", *raw)


def _rotation(w, x, y, z):
    raw = [round(v * 2**14) for v in (x, y, z, w)]
    return bytes([0x08, 1, 0, 0]) + struct.pack("<4h", *raw)


def test_bno085_switches_on_two_features_at_100_hz():
    bus = Bus()
    Bno085(bus)
    reports = [data[4 + 1] for data in bus.written]
    assert reports == [0x02, 0x08]
    for data in bus.written:
        length, channel, _ = struct.unpack_from("<HBB", data)
        assert (length, channel) == (len(data), 2) and data[4] == 0xFD
        assert struct.unpack_from("<I", data, 4 + 5)[0] == 10_000


def test_bno085_gives_orientation_and_rate():
    bus = Bus()
    bus.cargoes = [
        _cargo(b"advertisement of the sensor", channel=0),
        _cargo(TIME_BASE + _gyro(0.5, -1.0, 2.0)),
        _cargo(TIME_BASE + _gyro(0.25, -1.0, 2.0) + _rotation(HALF, 0, HALF, 0)),
    ]
    quat, gyro = Bno085(bus, sleep=lambda s: None).wait()
    np.testing.assert_allclose(quat, [HALF, 0, HALF, 0], atol=1e-4)
    np.testing.assert_allclose(gyro, [0.25, -1.0, 2.0], atol=2e-3)


def test_bno085_that_says_nothing_times_out():
    with pytest.raises(TimeoutError):
        Bno085(Bus(), sleep=lambda s: None).wait()


def test_reports_that_are_cut_or_unknown_end_a_cargo():
    rng = np.random.default_rng(5)
    whole = TIME_BASE + _gyro(1, 2, 3) + _rotation(1, 0, 0, 0)
    assert [kind for kind, _ in parse_reports(whole)] == [0x02, 0x08]
    for cut in range(len(whole)):
        assert len(parse_reports(whole[:cut])) <= 2
    assert parse_reports(b"\x77" + whole) == []
    for _ in range(500):
        parse_reports(rng.bytes(int(rng.integers(60))))


def test_rotations_agree_with_matrices():
    rng = np.random.default_rng(9)
    for _ in range(100):
        a, b, v = _random_quat(rng), _random_quat(rng), rng.normal(size=3)
        np.testing.assert_allclose(_matrix(multiply(a, b)), _matrix(a) @ _matrix(b))
        np.testing.assert_allclose(unrotate(a, v), _matrix(a).T @ v)
        np.testing.assert_allclose(_matrix(conjugate(a)), _matrix(a).T, atol=1e-12)
        np.testing.assert_allclose(gravity(a), _matrix(a).T @ [0, 0, -1], atol=1e-12)
        x = _matrix(a)[:, 0]
        assert heading(a) == pytest.approx(np.arctan2(x[1], x[0]))
    angle = np.deg2rad(20)
    roll = (np.cos(angle / 2), np.sin(angle / 2), 0, 0)
    pitch = (np.cos(angle / 2), 0, np.sin(angle / 2), 0)
    assert tilt(gravity(roll)) == pytest.approx((angle, 0))
    assert tilt(gravity(pitch)) == pytest.approx((0, angle))


def _matrix(q):
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
