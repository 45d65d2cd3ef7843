"""How little is known of what other joints push."""

import numpy as np
import pytest

from sysid.diagnosis.replay.timing_uncertainty import (
    FOLLOWS_S,
    UNREAD_STEPS,
    push_uncertainty,
    sampling_uncertainty,
)

DT = 0.01


def uncertainty(push, unread):
    read = np.ones((len(push), 1), bool)
    read[unread] = False
    return push_uncertainty(push[:, None], read, DT)[:, 0]


def test_a_step_that_nobody_read_is_uncertain_as_long_as_it_lasts():
    push = np.where(np.arange(200) < 100, -1.0, 2.0)
    sampled = sampling_uncertainty(push[:, None])[:, 0]
    extra = np.sqrt(uncertainty(push, 100) ** 2 - sampled**2)
    sure = np.flatnonzero(extra < 1e-6)
    # The step is between 99 and 100.
    first, last = 100 - UNREAD_STEPS, 99 + UNREAD_STEPS + round(FOLLOWS_S / DT)
    assert extra[first : last + 1] == pytest.approx(3.0)
    assert set(sure) == set(range(200)) - set(range(first, last + 1))


def test_what_holds_still_or_was_read_is_known():
    push = np.where(np.arange(200) < 100, -1.0, 2.0)
    known = sampling_uncertainty(push[:, None])[:, 0]
    assert uncertainty(push, 40) == pytest.approx(known)
    assert uncertainty(push, []) == pytest.approx(known)
