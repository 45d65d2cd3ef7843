import numpy as np
import pytest

from fingers_deploy.errors import InputError
from fingers_robot.drivers.dry import DryRun
from fingers_robot.drivers.replay import ReplayDriver
from fingers_robot.record.log import Log
from fingers_robot.record.row import ROW


def make_log(interface, count=50, joints=None):
    rows = np.zeros(count, ROW)
    rows["t"] = 3.0 + 0.02 * np.arange(count)
    rows["pos"] = np.arange(count)[:, None] * 0.01
    rows["quat"] = [1, 0, 0, 0]
    rows["supply"], rows["temp"] = 14.5, 33.0
    return Log("run.mcap", joints or interface.joint_names, rows, (), {}, True)


class Clock:
    t = 100.0

    def __call__(self):
        return self.t


def test_plays_at_its_own_pace(interface):
    clock = Clock()
    driver = ReplayDriver(make_log(interface), interface, clock)
    for k, late in ((0, 0.0), (7, 0.013), (49, 0.0), (49, 0.5)):
        clock.t = 100.0 + 0.02 * k + late + 1e-9
        reading = driver.read()
        assert reading.pos_rad[4] == pytest.approx(0.01 * k)
        assert clock.t - reading.t_s == pytest.approx(late, abs=1e-6)
        assert driver.imu().t_s == reading.t_s
    assert driver.over and driver.health().bus_v == 14.5


def test_is_never_live_and_only_pretends_power(interface):
    driver = ReplayDriver(make_log(interface), interface, Clock())
    assert not driver.info.live and driver.health().disabled
    driver.enable()
    assert driver.health().enabled


def test_other_joints_and_empty_logs_are_refused(interface):
    names = tuple(reversed(interface.joint_names))
    with pytest.raises(InputError, match="joints"):
        ReplayDriver(make_log(interface, joints=names), interface, Clock())
    with pytest.raises(InputError, match="no rows"):
        ReplayDriver(make_log(interface, count=0), interface, Clock())


class Watched:
    """A driver that counts what reaches it."""

    def __init__(self, inner):
        self._inner, self.calls = inner, []

    def __getattr__(self, name):
        if name in ("write", "enable", "disable"):
            self.calls.append(name)
        return getattr(self._inner, name)


def test_a_dry_run_reads_everything_and_moves_nothing(interface):
    watched = Watched(ReplayDriver(make_log(interface), interface, Clock()))
    dry = DryRun(watched)
    assert dry.health().disabled and "dry run" in dry.info.name
    dry.enable()
    dry.write(np.zeros(20))
    assert dry.health().enabled
    dry.disable()
    assert dry.health().disabled
    assert set(watched.calls) == {"disable"}
    np.testing.assert_array_equal(dry.read().pos_rad, watched.read().pos_rad)
