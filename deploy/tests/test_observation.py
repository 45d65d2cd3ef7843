import numpy as np
import pytest

from fingers_deploy import ObservationAssembler

SEED = 3
ORDER = ("joint_pos", "gravity_b", "angvel_b", "previous_action", "command")
SCALE = dict(zip(ORDER, (1.0, 1.0, 0.25, 1.0, 2.0), strict=True))
SIZE = dict(zip(ORDER, (20, 3, 3, 20, 3), strict=True))


def _samples(count):
    rng = np.random.default_rng(SEED)
    return [
        {name: rng.standard_normal(SIZE[name]).astype(np.float32) for name in ORDER}
        for _ in range(count)
    ]


def _brute_force(samples, interface):
    """The definition, entry by entry: term, then age, then component."""
    reference = np.asarray(interface.reference_angles_rad, np.float32)
    entries = []
    for name in ORDER:
        for age in range(7, -1, -1):
            value = samples[max(len(samples) - 1 - age, 0)][name]
            if name == "joint_pos":
                value = value - reference
            entries.extend(float(np.float32(SCALE[name]) * v) for v in value)
    return np.asarray(entries, np.float32)


@pytest.fixture
def assembler(interface):
    return ObservationAssembler(interface)


def test_history_is_oldest_first_and_term_major(assembler, interface):
    samples, history = _samples(20), None
    for step in range(20):
        history = assembler.update(history, assembler.sample(**samples[step]))
        found = assembler.flatten(history)
        wanted = _brute_force(samples[: step + 1], interface)
        assert found.shape == (392,) and found.dtype == np.float32
        np.testing.assert_array_equal(found, wanted)
        if step:
            newest_first = _brute_force(samples[step::-1], interface)
            assert np.abs(found - newest_first).max() > 0.1


def test_updates_leave_the_old_history_alone(assembler):
    first, second = (assembler.sample(**s) for s in _samples(2))
    history = assembler.update(None, first)
    before = assembler.flatten(history)
    assembler.update(history, second)
    np.testing.assert_array_equal(assembler.flatten(history), before)


@pytest.mark.parametrize("name", ORDER)
def test_other_shapes_are_refused(assembler, name):
    sample = _samples(1)[0]
    for wrong in (sample[name][:-1], sample[name][None], np.float32(0)):
        with pytest.raises(ValueError, match=name):
            assembler.sample(**{**sample, name: wrong})
