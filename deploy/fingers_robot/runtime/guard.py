"""The guard: opens a hand for one purpose, to de-energize it."""

import contextlib
import time
from collections.abc import Callable, Mapping
from typing import Any

from fingers_deploy.manifest import Interface
from fingers_robot.drivers.open import open_driver
from fingers_robot.drivers.protocol import Driver

TRIES = 4
CONFIRM_S = 0.5


def guard_hand(options: Mapping[str, Any], interface: Interface) -> tuple[bool, str]:
    """Opens a hand, de-energizes it, lets go of it.

    Args:
        options: of the driver, as `drivers.open_driver` takes them.
        interface: of the policy.

    Returns:
        Whether the hand confirmed that it is de-energized, and that in words.
    """
    try:
        driver = open_driver({**options, "without_imu": True}, interface)
        safe = make_safe(driver)
        driver.close()
    except Exception as error:
        # Whatever a driver raises: nobody else is left to sound the alarm.
        return False, f"{type(error).__name__}: {error}: CUT THE BATTERY"
    if not safe:
        return False, "NOT CONFIRMED: CUT THE BATTERY"
    return True, "de-energized, confirmed"


def make_safe(
    driver: Driver,
    now: Callable[[], float] = time.monotonic,
    sleep: Callable[[float], None] = time.sleep,
) -> bool:
    """De-energizes a hand and waits for the hand itself to confirm it.

    Returns:
        Whether a read-back that is newer than the request says so.
    """
    for _ in range(TRIES):
        asked = now()
        try:
            driver.disable()
            while now() - asked < CONFIRM_S:
                with contextlib.suppress(Exception):
                    driver.read()  # takes what has come; only health counts here
                health = driver.health()
                if health is not None and health.disabled and health.t_s > asked:
                    return True
                sleep(0.005)
        except Exception:
            # Whatever it is, only another try can help; the caller sounds the alarm.
            sleep(0.05)
    return False
