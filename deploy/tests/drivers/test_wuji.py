import dataclasses
import importlib.util
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from fingers_deploy.errors import InputError
from fingers_deploy.rotations import conjugate
from fingers_robot.behaviour.exchange import Answer, propose
from fingers_robot.drivers.open import open_driver
from fingers_robot.drivers.wuji import WujiDriver
from fingers_robot.reading import ImuReading
from fingers_robot.runtime.core import Core
from fingers_robot.runtime.guard import guard_hand, make_safe
from fingers_robot.runtime.ticker import Ticker
from fingers_robot.safety import Mode, Operator, make_limits
from fingers_robot.safety.detectors.health import unhealthy


class StillImu:
    def __init__(self, quat=(1.0, 0.0, 0.0, 0.0)):
        self.rng, self.quat, self.closed = (
            np.random.default_rng(0),
            np.array(quat),
            False,
        )

    def read(self):
        gyro = 1e-3 * self.rng.standard_normal(3)
        return ImuReading(time.monotonic(), self.quat, gyro)

    def close(self):
        self.closed = True


@pytest.fixture
def library():
    """A fresh fake library."""
    path = Path(__file__).with_name("fake_wujihandpy.py")
    spec = importlib.util.spec_from_file_location("fake_wujihandpy", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def driver(library, interface):
    opened = WujiDriver(library, interface, StillImu())
    yield opened
    opened.close()


def _wait(condition, seconds=20.0):
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        if condition():
            return True
        time.sleep(0.002)
    return False


def test_opens_de_energized_with_its_limits_and_filter(library, driver):
    device = library.DEVICE
    assert not device.enabled.any()
    assert (device.effort_limit == 1.0).all() and device.cutoff == 3.0
    assert driver.info.lowpass_hz == 3.0
    np.testing.assert_array_equal(driver.info.joint_limits_rad[3], [-0.6, 1.7])


def test_old_firmware_is_opened_to_be_de_energized_but_not_read(library, interface):
    """The guard must get in; a run without efforts must not."""
    library.DEVICE.firmware = (1, 0)
    old = WujiDriver(library, interface, StillImu())
    assert "unknown serial" in old.info.name
    with pytest.raises(RuntimeError, match="firmware version"):
        old.read()
    assert make_safe(old)
    old.close()


def test_the_guard_needs_no_imu(library, interface, monkeypatch):
    monkeypatch.setitem(sys.modules, "wujihandpy", library)
    options = {"kind": "wuji", "side": "right", "imu_bus": 99, "imu_address": 0x4A,
               "imu_mount": (1.0, 0.0, 0.0, 0.0)}  # fmt: skip
    with pytest.raises(OSError, match="i2c-99"):
        open_driver(options, interface)
    library.DEVICE.enabled[:] = True
    assert guard_hand(options, interface) == (True, "de-energized, confirmed")
    assert not library.DEVICE.enabled.any()


def test_joints_keep_their_order(library, driver):
    np.testing.assert_array_equal(driver.read().pos_rad, library.DEVICE.pos.reshape(-1))
    target = np.linspace(0, 1, 20)
    driver.write(target)
    np.testing.assert_array_equal(library.DEVICE.targets[-1].reshape(-1), target)


def test_the_loop_makes_no_slow_transaction(library, driver):
    _wait(lambda: driver.health() is not None)
    library.DEVICE.calls.clear()
    library.DEVICE.slow_s = 0.05
    for _ in range(50):
        driver.read(), driver.imu(), driver.health(), driver.write(np.zeros(20))
    driver.enable()
    driver.disable()
    _wait(lambda: library.DEVICE.calls)
    assert {thread for thread, _ in library.DEVICE.calls} == {"slow path"}


def test_power_is_confirmed_by_a_newer_read_back(library, driver):
    assert _wait(lambda: driver.health() is not None)
    asked = time.monotonic()
    driver.enable()
    assert _wait(lambda: driver.health().enabled and driver.health().t_s > asked)
    assert library.DEVICE.enabled.all()
    driver.disable()
    assert _wait(lambda: driver.health().disabled)
    assert not library.DEVICE.enabled.any()


def test_values_freeze_silently_but_the_slow_path_shows_it(library, driver):
    assert _wait(lambda: driver.health() is not None)
    first = driver.read().pos_rad
    library.DEVICE.connected = False
    library.DEVICE.pos += 0.3
    np.testing.assert_array_equal(driver.read().pos_rad, first)

    def raises():
        try:
            driver.health()
        except ConnectionError:
            return True
        return False

    assert _wait(raises, 10.0)


def test_heat_derates_the_fake_and_is_reported(library, driver, bundle):
    library.DEVICE.temperature[2, 1] = 86.0
    assert library.DEVICE.effective_effort_limit[2, 1] == pytest.approx(0.7)
    assert _wait(
        lambda: driver.health() is not None and driver.health().temperature_c.max() > 80
    )
    limits = make_limits(bundle.manifest, driver.info.joint_limits_rad)
    assert "joint 9 at 86" in " ".join(unhealthy(driver.health(), limits))


def test_error_bits_are_named(library, driver, bundle):
    library.DEVICE.error[4, 3] = 1 << 13 | 1 << 3
    assert _wait(
        lambda: driver.health() is not None and driver.health().error_code.any()
    )
    limits = make_limits(bundle.manifest, driver.info.joint_limits_rad)
    words = " ".join(unhealthy(driver.health(), limits))
    assert "joint 19" in words
    assert "encoder 1 communication, over-temperature" in words


@pytest.mark.parametrize("bad", [np.full(20, np.nan), np.zeros(19)])
def test_nonsense_never_reaches_the_library(library, driver, bad):
    with pytest.raises(ValueError, match="20 finite numbers"):
        driver.write(bad)
    assert library.DEVICE.targets == []


def test_a_left_hand_is_refused(library, interface):
    library.DEVICE.handedness = 1
    with pytest.raises(InputError, match="left"):
        WujiDriver(library, interface, StillImu())
    assert not library.DEVICE.enabled.any()


def test_other_joint_names_are_refused(library, interface):
    names = ("finger1_joint2", "finger1_joint1", *interface.joint_names[2:])
    wrong = dataclasses.replace(interface, joint_names=names)
    with pytest.raises(InputError, match="finger1_joint1"):
        WujiDriver(library, wrong, StillImu())


def test_closing_de_energizes_and_may_be_repeated(library, interface):
    imu = StillImu()
    driver = WujiDriver(library, interface, imu)
    driver.enable()
    assert _wait(lambda: library.DEVICE.enabled.all())
    driver.close()
    driver.close()
    assert not library.DEVICE.enabled.any() and imu.closed


def test_the_last_request_for_power_is_never_lost(library, driver):
    """Also while the thread that serves requests is about to look for the next one."""
    library.DEVICE.slow_s = 0.0
    rng = np.random.default_rng(0)
    for _ in range(60):
        for _ in range(int(rng.integers(1, 200))):
            driver.enable()
        driver.disable()
        assert _wait(lambda: not driver._slow._wanted, 2.0)
        assert _wait(lambda: driver.health() and driver.health().disabled, 2.0)
        assert not library.DEVICE.enabled.any()


def test_the_guard_confirms_or_says_so(library, interface):
    driver = WujiDriver(library, interface, StillImu())
    library.DEVICE.enabled[:] = True
    assert make_safe(driver)
    assert not library.DEVICE.enabled.any()
    library.DEVICE.connected = False
    assert not make_safe(driver)
    driver.close()


class EchoLink:
    """A policy that holds still."""

    open = True

    def __init__(self):
        self.answer = None

    def send(self, query):
        proposal = propose(query, query.target_rad)
        self.answer = Answer(proposal, np.zeros(9, np.float32), 0)

    def poll(self):
        answer, self.answer = self.answer, None
        return answer


@pytest.fixture
def core(library, marching):
    """The supervisor on the fake hand, which follows its targets while energized."""
    interface = marching.manifest.interface
    limits = np.asarray(interface.joint_limits_rad)
    start = np.asarray(interface.initial_target_rad)
    library.DEVICE.pos = np.clip(start, limits[:, 0], limits[:, 1]).reshape(5, 4)
    driver = WujiDriver(library, interface, StillImu(conjugate(interface.v_quat_b)))
    driver.info = dataclasses.replace(driver.info, joint_limits_rad=limits)
    # A loaded machine is not what is tested here: everything about time is off.
    slow = dict.fromkeys(
        ("gap_s", "lease_s", "obs_age_s", "frozen_imu_s", "frozen_joints_s"), 60.0
    )
    limit = make_limits(
        marching.manifest,
        limits,
        settle_s=0.3,
        health_age_s=60.0,
        skipped_ticks=10**6,
        **slow,
    )
    loop = Core(driver, EchoLink(), (limit,), interface, 4, time.monotonic, wiggle=())
    loop.driver = driver
    yield loop
    driver.close()


def _run(core, device, seconds, operator=Operator.NONE, until=None):
    ticker, begin, rng = Ticker(0.005), time.monotonic(), np.random.default_rng(1)
    base = core._last_control * 4
    while time.monotonic() - begin < seconds:
        tick = ticker.wait()
        tick = dataclasses.replace(tick, number=base + tick.number)
        core.tick(tick, operator)
        operator = Operator.NONE
        if device.enabled.any() and device.targets:
            device.pos = device.pos + 0.3 * (device.targets[-1] - device.pos)
        device.pos = device.pos + 1e-5 * rng.standard_normal((5, 4))
        if core.state.mode == until:
            return True
    return until is None


def test_unplugging_while_active_disables_and_sounds_the_alarm(library, core):
    device = library.DEVICE
    _run(core, device, 0.4)
    assert _run(core, device, 30.0, Operator.ARM, until=Mode.ACTIVE), core.checks
    _run(core, device, 0.3)
    device.connected = False
    assert _run(core, device, 10.0, until=Mode.SAFE)
    assert "S15" in {f.id for f in core.state.faults}
    written = len(device.targets)
    _run(core, device, 1.2)
    assert len(device.targets) == written
    assert core.state.tries > 4 and not core.state.confirmed


def test_a_hot_joint_settles_and_disables(library, core):
    device = library.DEVICE
    _run(core, device, 0.4)
    assert _run(core, device, 30.0, Operator.ARM, until=Mode.ACTIVE)
    device.temperature[0, 0] = 93.0
    assert _run(core, device, 10.0, until=Mode.STOPPING)
    assert _run(core, device, 10.0, until=Mode.SAFE)
    assert {f.id for f in core.state.faults} == {"S6"}
    _run(core, device, 0.5)
    assert core.state.confirmed and not device.enabled.any()
