import jax.numpy as jnp
import numpy as np

from envs.commands import CommandConfig, command_term
from envs.observations import (
    HISTORY,
    TERMS,
    InputTerm,
    Sample,
    flatten,
    push,
    start_history,
)

SIZES = {"joint_pos": 20, "gravity": 3, "angvel": 3, "action": 20, "command": 3}
OFFSETS = {"joint_pos": 0, "gravity": 160, "angvel": 184, "action": 208, "command": 368}
"""Where each term's history begins in the 392 inputs (paper, observation)."""


def sample(number: float) -> Sample:
    """Values that distinguish step, term and entry: 100 step + 1000 term + entry."""
    entries = {
        name: 100.0 * number + 1000.0 * index + jnp.arange(float(size))
        for index, (name, size) in enumerate(SIZES.items())
    }
    command = entries.pop("command")
    return Sample(**entries, inputs={"command": command})


COMMAND = (command_term(CommandConfig()),)


def value(one: Sample, name: str):
    return one.inputs["command"] if name == "command" else getattr(one, name)


def test_order_is_term_by_term_and_oldest_to_newest():
    history = start_history(sample(0))
    for number in range(1, HISTORY + 3):
        history = push(history, sample(number))
    vector = np.asarray(flatten(history, COMMAND))
    assert vector.shape == (392,)
    expected = np.concatenate(
        [
            np.concatenate([np.asarray(value(sample(n), term)) for n in range(3, 11)])
            for term in SIZES
        ]
    )
    np.testing.assert_array_equal(vector, expected)
    assert list(SIZES) == [*TERMS, "command"]


def test_an_episode_begins_with_the_first_sample_eight_times():
    vector = np.asarray(flatten(start_history(sample(7)), COMMAND))
    for name, size in SIZES.items():
        block = vector[OFFSETS[name] :][: HISTORY * size].reshape(HISTORY, size)
        np.testing.assert_array_equal(block, np.tile(value(sample(7), name), (8, 1)))


def test_other_tasks_have_more_inputs():
    """Paper: 3, 7 and 9 task inputs make 392, 424 and 440."""
    for sizes, total in (((3,), 392), ((4, 3), 424), ((3, 3, 3), 440)):
        terms = tuple(InputTerm(f"z{i}", n, "V", "m") for i, n in enumerate(sizes))
        inputs = {term.name: jnp.full(term.size, 7.0) for term in terms}
        wide = start_history(sample(0).replace(inputs=inputs))
        assert flatten(wide, terms).shape == (total,)


def test_inputs_come_in_the_order_of_the_task_and_not_of_their_names():
    terms = (InputTerm("late", 1, "V", "m"), InputTerm("early", 2, "V", "m"))
    inputs = {"early": jnp.full(2, 1.0), "late": jnp.full(1, 2.0)}
    vector = flatten(start_history(sample(0).replace(inputs=inputs)), terms)
    np.testing.assert_array_equal(vector[-24:], [2.0] * 8 + [1.0] * 16)


def test_the_environment_shows_what_happened_in_that_order(crawl):
    """Nine steps: the first sample of the episode has just left the history."""
    actions = crawl.actions(9)
    states = crawl.roll(crawl.first, actions)
    assert not any(np.asarray(state.done).any() for state in states)
    vector = np.asarray(states[-1].obs["state"])
    config, stance = crawl.batch.config, crawl.batch.stance

    def block(name):
        start, size = OFFSETS[name], SIZES[name]
        return vector[:, start : start + HISTORY * size].reshape(8, HISTORY, size)

    for age, state in enumerate(reversed(states[1:])):
        at = HISTORY - 1 - age
        np.testing.assert_array_equal(block("action")[:, at], state.memory.action)
        np.testing.assert_array_equal(block("command")[:, at], state.memory.command)
        joints = state.data.qpos[:, 7:] - np.float32(stance.joint_pos_rad)
        error = np.abs(block("joint_pos")[:, at] - joints)
        assert 0 < error.max() <= config.randomize.joint_noise_rad * 1.001
        down = block("gravity")[:, at]
        np.testing.assert_allclose(np.linalg.norm(down, axis=1), 1.0, atol=1e-6)
        bound = np.sqrt(3) * (config.randomize.imu_tilt_rad + 0.01)
        np.testing.assert_allclose(down, state.signals.gravity_b, atol=bound)
        spin = np.asarray(state.data.qvel[:, 3:6])
        bound = 0.1 + np.sqrt(3) * config.randomize.imu_tilt_rad * np.abs(spin).max()
        np.testing.assert_allclose(block("angvel")[:, at], spin, atol=bound)
    # The comparison can fail: each step's action is another one.
    assert not np.array_equal(block("action")[:, 0], states[-1].memory.action)
