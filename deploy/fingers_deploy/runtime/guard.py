"""The guard: opens a hand for one purpose, to de-energize it."""

import time
from collections.abc import Callable

from fingers_deploy.drivers.protocol import Driver

TRIES = 4
CONFIRM_S = 0.5


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
                driver.read()
                health = driver.health()
                if health is not None and health.disabled and health.t_s > asked:
                    return True
                sleep(0.005)
        except Exception:
            # Whatever it is, only another try can help; the caller sounds the alarm.
            sleep(0.05)
    return False
