"""A stand-in for `wujihandpy` 1.8 that behaves as its documentation says.

- Real-time calls never raise: after a disconnect they return the last cached value for
  ever. The cache holds zeros before the first frame.
- Slow transactions raise ConnectionError once the hand is gone, and take time.
- One thread only, unless the check is switched off.
- Temperatures of 85 °C derate the effective effort limit to 70 %, of 93 °C to 40 %.
- Targets are clamped to the factory limits. Firmware keeps the last target.
"""

import threading
import time

import numpy as np


class _LowPass:
    def __init__(self, cutoff_freq=10.0):
        self.cutoff_freq = cutoff_freq


class filter:
    LowPass = _LowPass


class Device:
    """What a test sees of the hand: state that it changes and commands that came."""

    def __init__(self):
        self.pos = np.linspace(-0.2, 0.5, 20).reshape(5, 4)
        self.effort = np.zeros((5, 4))
        self.temperature = np.full((5, 4), 40.0, np.float32)
        self.error = np.zeros((5, 4), np.uint32)
        self.volts = 14.8
        self.handedness = 0
        self.firmware = (1, 2)
        self.connected = True
        self.frames = True
        self.enabled = np.zeros((5, 4), bool)
        self.effort_limit = np.full((5, 4), 1.5)
        self.targets = []
        self.cutoff = None
        self.slow_s = 0.001
        self.calls = []

    @property
    def effective_effort_limit(self):
        share = np.where(self.temperature >= 93, 0.4, 1.0)
        share = np.where((self.temperature >= 85) & (share == 1.0), 0.7, share)
        return share * self.effort_limit


DEVICE = Device()


class Hand:
    def __init__(self, serial_number=None, *, side=None, usb_pid=0x2000,
                 usb_vid=0x0483, mask=None):  # fmt: skip
        self._device = DEVICE
        self._owner = threading.get_ident()
        self._checked = True
        self._busy = threading.Lock()
        if not DEVICE.connected:
            raise ConnectionError("no device")

    def disable_thread_safe_check(self):
        self._checked = False

    def _slow(self, name, timeout=0.5):
        device = self._device
        device.calls.append((threading.current_thread().name, name))
        if self._checked and threading.get_ident() != self._owner:
            raise RuntimeError("called from another thread")
        if not self._busy.acquire(blocking=False):
            raise RuntimeError("two transactions at once")
        try:
            time.sleep(device.slow_s)
        finally:
            self._busy.release()
        if not device.connected:
            raise ConnectionError("device disconnected")

    def read_handedness(self, timeout=0.5):
        self._slow("read_handedness")
        return self._device.handedness

    def get_full_system_firmware_version(self):
        major, minor = self._device.firmware
        return np.uint32(major | minor << 8 | 0x7E << 24)

    def get_product_sn(self):
        if self._device.firmware < (1, 1):
            raise TimeoutError("no answer for 3 s")
        return "FAKE-1"

    def read_joint_lower_limit(self, timeout=0.5):
        self._slow("read_joint_lower_limit")
        return np.full((5, 4), -0.6)

    def read_joint_upper_limit(self, timeout=0.5):
        self._slow("read_joint_upper_limit")
        return np.full((5, 4), 1.7)

    def read_joint_actual_position(self, timeout=0.5):
        self._slow("read_joint_actual_position")
        return self._device.pos.copy()

    def read_joint_temperature(self, timeout=0.5):
        self._slow("read_joint_temperature")
        return self._device.temperature.copy()

    def read_joint_error_code(self, timeout=0.5):
        self._slow("read_joint_error_code")
        return self._device.error.copy()

    def read_joint_effort_limit(self, timeout=0.5):
        self._slow("read_joint_effort_limit")
        return self._device.effort_limit.copy()

    def read_input_voltage(self, timeout=0.5):
        self._slow("read_input_voltage")
        return np.float32(self._device.volts)

    def write_joint_enabled(self, value, timeout=0.5):
        self._slow(f"write_joint_enabled {value}")
        self._device.enabled[:] = value

    def write_joint_effort_limit(self, value, timeout=0.5):
        self._slow("write_joint_effort_limit")
        self._device.effort_limit[:] = value

    def realtime_controller(self, enable_upstream, filter):
        assert enable_upstream
        self._device.cutoff = filter.cutoff_freq
        return _Controller(self._device)


class _Controller:
    def __init__(self, device):
        self._device = device
        self._cache = np.zeros((5, 4)), np.zeros((5, 4))
        self.closed = False

    def _refresh(self):
        if self._device.connected and self._device.frames:
            self._cache = self._device.pos.copy(), self._device.effort.copy()
        return self._cache

    def get_joint_actual_position(self):
        return self._refresh()[0]

    def get_joint_actual_effort(self):
        if self._device.firmware < (1, 2):
            raise RuntimeError("Effort feedback requires firmware version >= 1.2.0")
        return self._refresh()[1]

    def set_joint_target_position(self, value_array):
        assert np.shape(value_array) == (5, 4)
        self._device.targets.append(np.clip(value_array, -0.6, 1.7))

    def close(self):
        self.closed = True
