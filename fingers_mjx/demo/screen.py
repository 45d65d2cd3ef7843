"""Where the demonstration says what it is doing."""

import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass

from fingers_mjx.evaluation.evaluate import Progress
from fingers_mjx.training.progress import OnProgress


@dataclass(frozen=True)
class Screen:
    """Where progress goes.

    Attributes:
        say: told one line.
        counting: (activity, unit) -> what is told (done, in all).
        reporting: () -> what is told the events of training.
    """

    say: Callable[[str], None]
    counting: Callable[[str, str], AbstractContextManager[Progress]]
    reporting: Callable[[], AbstractContextManager[OnProgress]]


@contextmanager
def timed(screen: Screen, what: str) -> Iterator[None]:
    """Says what begins, and how long it took."""
    screen.say(what)
    start_s = time.monotonic()
    yield
    screen.say(f"done in {time.monotonic() - start_s:.0f} s")
