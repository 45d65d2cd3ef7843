"""What every registered task keeps to, and every reward table that it can be paid by.

A new task is tested by being registered, a new table by being in `rewards.TABLES`.
"""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from envs.batch import BatchEnv
from envs.registry import task_names
from rewards import TABLES

INFO = {"truncation", "invalid", "episode_return", "episode_length"}


TASKS = [(name, None) for name in task_names()]
OTHERS = [(task, name) for task, tables in TABLES.items() for name in [*tables][1:]]
"""Tables other than a task's default."""


@pytest.fixture(
    scope="module", params=TASKS + OTHERS, ids=lambda p: "-".join(filter(None, p))
)
def make(request, make_compiled):
    """Makes the task with so many worlds."""
    name, table = request.param
    changes = {"rewards": table} if table else {}
    return lambda *worlds: make_compiled(name, *worlds, **changes)


@pytest.fixture(scope="module")
def task(make):
    return make()


@pytest.fixture(scope="module")
def rollout(task):
    """Two and a half episodes of violent actions, so that some worlds also fall."""
    return task.roll(task.first, task.actions(50, scale=2.0))


def with_first_world_everywhere(state):
    return jax.tree.map(lambda x: jnp.broadcast_to(x[:1], x.shape), state)


def at_last_step(task, state):
    steps = jnp.full_like(state.memory.steps, task.batch.episode_length - 1)
    return state.replace(memory=state.memory.replace(steps=steps))


def test_shapes_and_types_never_change(task, rollout):
    def kinds(state):
        leaves = jax.tree_util.tree_leaves_with_path(state)
        return {jax.tree_util.keystr(p): (x.shape, x.dtype) for p, x in leaves}

    first = kinds(task.first)
    assert all(kinds(state) == first for state in rollout)
    for name, (shape, dtype) in first.items():
        assert shape[0] == task.batch.num_envs, name
        key = jnp.issubdtype(dtype, jax.dtypes.prng_key)
        assert key or dtype in (np.float32, np.int32, np.bool_), name


def test_observations_and_info_are_those_of_the_contract(task, rollout):
    sizes = task.batch.observation_size
    assert set(sizes) == {"state", "privileged_state"}
    for state in (task.first, rollout[-1]):
        assert {k: x.shape[1] for k, x in state.obs.items()} == sizes
        assert set(state.info) == INFO
        assert all(np.isfinite(x).all() for x in state.obs.values())
    actor = task.first.obs["state"]
    privileged = task.first.obs["privileged_state"][:, : actor.shape[1]]
    np.testing.assert_array_equal(privileged, actor)


def test_logged_terms_add_up_to_the_reward(task, rollout):
    total = np.zeros(task.batch.num_envs, np.float32)
    for state in rollout:
        terms = sorted(k for k in state.metrics if k.startswith("reward/"))
        assert len(terms) > 1
        # One after another in float32, as `rewards.evaluate` promises.
        total[:] = 0
        for name in terms:
            total += np.asarray(state.metrics[name])
        np.testing.assert_array_equal(state.reward, total)
    assert np.abs(total).max() > 0


def test_same_seed_same_bits_other_seed_other_bits(task, rollout, differing):
    again = task.reset(jax.random.key(task.seed))
    assert differing(again, task.first) == []
    actions = task.actions(50, scale=2.0)
    assert differing(task.roll(again, actions)[-1], rollout[-1]) == []
    other = task.reset(jax.random.key(1))
    assert ".data.qpos" in differing(other, task.first)


def test_worlds_are_different_from_each_other(task):
    for x in (task.first.data.qpos, task.first.obs["state"]):
        assert len(np.unique(np.asarray(x), axis=0)) == task.batch.num_envs


def test_ends_are_distinguished(task, rollout):
    for state in rollout:
        info = state.info
        flags = (state.done, info["truncation"], info["invalid"])
        done, truncated, invalid = map(np.asarray, flags)
        for flag in (done, truncated, invalid):
            assert set(np.unique(flag)) <= {0.0, 1.0}
        assert not (truncated * invalid).any()
        assert (truncated <= done).all() and (invalid <= done).all()
        assert not invalid.any()
    assert any(np.asarray(state.done).any() for state in rollout)


def test_the_time_limit_truncates(task):
    state = task.step(at_last_step(task, task.first), task.actions(1)[0] * 0)
    np.testing.assert_array_equal(state.done, 1)
    np.testing.assert_array_equal(state.info["truncation"], 1)


def test_first_episodes_are_cut_short_at_times_of_their_own(task):
    """By the time limit, once, and nothing else of the episode is changed."""
    batch = BatchEnv(task.batch.env, task.batch.num_envs, spread_ends=True)
    still = task.actions(1)[0] * 0
    step = jax.jit(batch.step)
    state, ends = task.first, []
    for _ in range(2 * batch.episode_length):
        state = step(state, still)
        ends.append(np.asarray(state.info["truncation"]))
    ends = np.array(ends)
    assert (ends[: batch.episode_length].sum(0) == 1).all()
    assert len(set(ends.argmax(0).tolist())) > 2
    for world in ends.T:
        assert (np.diff(np.flatnonzero(world)) == batch.episode_length).all()


def test_sums_of_an_episode_begin_anew(task, rollout):
    length = np.zeros(task.batch.num_envs)
    total = np.zeros(task.batch.num_envs)
    for state in rollout:
        length, total = length + 1, total + np.asarray(state.reward)
        np.testing.assert_array_equal(state.info["episode_length"], length)
        np.testing.assert_allclose(state.info["episode_return"], total, atol=1e-4)
        running = np.asarray(state.done) == 0
        length, total = length * running, total * running


def test_nothing_leaks_through_a_reset(task, differing):
    """Two lives of one world that end in the same step go on as one."""
    state = with_first_world_everywhere(task.first)
    same, *lives = task.actions(6)
    state = task.step(state, np.broadcast_to(same[:1], same.shape))
    assert differing(state, state, 0, 1) == []
    state = task.roll(state, lives)[-1]
    assert not np.asarray(state.done).any()
    lived = differing(state, state, 0, 1)
    assert {".data.qpos", ".memory.target", ".memory.action"} <= set(lived)

    after = task.step(at_last_step(task, state), lives[0])
    assert np.asarray(after.done).all()
    kept = (after.data, after.obs, after.memory)
    assert differing(kept, kept, 0, 1) == []
    np.testing.assert_array_equal(after.memory.steps, 0)
    np.testing.assert_array_equal(after.memory.action, 0)


def test_an_end_resets_its_world_only(task, differing):
    state = task.roll(task.first, task.actions(3))[-1]
    action = task.actions(1)[0]
    steps = state.memory.steps.at[2].set(task.batch.episode_length - 1)
    ending = state.replace(memory=state.memory.replace(steps=steps))
    ended, going = task.step(ending, action), task.step(state, action)
    np.testing.assert_array_equal(ended.done, np.arange(len(steps)) == 2)
    others = np.arange(len(steps)) != 2
    assert differing(ended, going, others) == []
    assert ".data.qpos" in differing(ended, going, 2)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e20])
@pytest.mark.parametrize(("name", "entry"), [("qpos", 9), ("qvel", 7)])
def test_a_state_that_is_not_finite_ends_its_episode_and_is_counted(
    task, name, entry, value, differing
):
    """T8: one world of many, set aside in the same step; the others are the same."""
    action = task.actions(1)[0]
    data = task.first.data
    spoiled = {name: getattr(data, name).at[1, entry].set(value)}
    bad = task.first.replace(data=data.replace(**spoiled))
    state, good = task.step(bad, action), task.step(task.first, action)

    hit = np.arange(task.batch.num_envs) == 1
    np.testing.assert_array_equal(state.info["invalid"], hit)
    np.testing.assert_array_equal(state.done, hit)
    np.testing.assert_array_equal(state.info["truncation"], 0)
    assert differing(state, good, ~hit) == []
    # It pays nothing, is replaced by a sound start, and leaves nothing behind.
    for term, x in {**state.metrics, "reward": state.reward}.items():
        assert np.isfinite(x).all(), term
        assert not term.startswith("reward") or x[1] == 0, term
    carried = (state.data, state.obs, state.memory)
    # Schedules may hold infinite steps; everything else is finite.
    weights = "world.weights"
    leaves = jax.tree_util.tree_leaves_with_path(carried)
    for path, x in leaves:
        leaf = jax.tree_util.keystr(path)
        if jnp.issubdtype(x.dtype, np.floating) and weights not in leaf:
            assert np.isfinite(x).all(), leaf
    after = task.roll(state, task.actions(3))[-1]
    assert not np.asarray(after.info["invalid"]).any()


def test_an_invalid_last_step_is_not_a_time_limit(task):
    data = task.first.data
    bad = data.replace(qvel=data.qvel.at[1, 7].set(np.nan))
    last = at_last_step(task, task.first.replace(data=bad))
    state = task.step(last, task.actions(1)[0])
    np.testing.assert_array_equal(state.done, 1)
    hit = np.arange(task.batch.num_envs) == 1
    np.testing.assert_array_equal(state.info["truncation"], ~hit)
    np.testing.assert_array_equal(state.info["invalid"], hit)


def test_a_nan_action_is_an_invalid_step_and_an_infinite_one_a_full_one(task):
    action = task.actions(1)[0]
    action[0, 3], action[1, 3], action[2, 3] = np.nan, np.inf, -np.inf
    state = task.step(task.first, action)
    np.testing.assert_array_equal(
        state.info["invalid"], np.arange(task.batch.num_envs) == 0
    )
    assert np.isfinite(state.reward).all()
    assert all(np.isfinite(x).all() for x in state.obs.values())


def test_weights_are_arguments_of_the_compiled_step(task):
    def doubled(path, x):
        values = ("value", "start", "before", "after")
        return 2 * x if path[-1].name in values else x

    memory = task.first.memory
    weights = jax.tree_util.tree_map_with_path(doubled, memory.world.weights)
    world = memory.world.replace(weights=weights)
    dear = task.first.replace(memory=memory.replace(world=world))
    action = task.actions(1)[0]
    reward = np.asarray(task.step(task.first, action).reward)
    programs = task.step._cache_size()
    np.testing.assert_array_equal(task.step(dear, action).reward, 2 * reward)
    assert reward.any() and task.step._cache_size() == programs


def test_no_call_after_the_first_compiles_anything(task, rollout):
    """Neither from the reset, nor from a step, nor from an automatic restart."""
    key, action = jax.random.key(3), task.actions(1)[0]
    ending = at_last_step(task, rollout[-1])
    events = []
    jax.monitoring.register_event_duration_secs_listener(
        lambda name, *_, **__: events.append(name) if "compile" in name else None
    )
    state = task.step(task.reset(key), action)
    state = task.step(state, action)
    restarted = task.step(ending, action)
    state = task.step(restarted, action)
    assert events == []
    jax.jit(lambda x: x * 3.5)(jnp.ones(11))  # negative control: this one compiles
    assert events != []


def test_a_world_does_not_depend_on_how_many_are_stepped(task, rollout, make):
    two = make(2)
    actions = task.actions(25, scale=0.5)
    few, many = two.first, task.first
    for action in actions:
        few, many = two.step(few, action[:2]), task.step(many, action)
    for x, y in zip(
        jax.tree.leaves((few.data, few.obs, few.reward)),
        jax.tree.leaves((many.data, many.obs, many.reward)),
        strict=True,
    ):
        np.testing.assert_array_equal(x, y[:2])


def test_every_world_counts_its_own_steps(task, rollout):
    world = rollout[-1].memory.world
    np.testing.assert_array_equal(world.total_steps, len(rollout))
    ends = sum(np.asarray(state.done) for state in rollout)
    np.testing.assert_array_equal(world.episodes, ends)


def test_the_draw_of_a_world_outlives_its_episodes(task, rollout, differing):
    kept = [state.memory.world.variation for state in (task.first, rollout[-1])]
    assert differing(*kept) == []
