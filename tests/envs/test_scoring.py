import jax.numpy as jnp
import numpy as np
import pytest

from envs.errors import InputError
from envs.memory import PerWorldState
from envs.scoring import scheduled_weights, score
from rewards import CRAWL, RewardTerm, StepSwitch, precomputed

TABLE = (
    RewardTerm("one", precomputed, 2.0, ("a",)),
    RewardTerm("two", precomputed, StepSwitch(0.0, -1.0, at_steps=10), ("b",)),
)


def world(steps=0, values=None, pace=1.0, own=None):
    weights = scheduled_weights(TABLE, values or {}, pace, own or {})
    return PerWorldState(
        key=None,
        variation=None,
        footprint=None,
        weights=weights,
        total_steps=jnp.int32(steps),
        episodes=jnp.int32(0),
    )


def pay(world, valid=True, a=3.0):
    named = {"a": jnp.float32(a), "b": jnp.float32(5.0)}
    return score(TABLE, world, named, 0.02, jnp.array(valid))


def test_terms_are_weight_times_magnitude_times_interval():
    after, reward, terms = pay(world())
    assert terms == pytest.approx({"one": 2 * 3 * 0.02, "two": 0.0})
    assert reward == pytest.approx(0.12) and after.total_steps == 1


def test_schedules_follow_the_steps_before_this_one():
    assert pay(world(9))[2]["two"] == 0
    assert pay(world(10))[2]["two"] == pytest.approx(-0.1)
    assert pay(world(5, pace=0.5))[2]["two"] == pytest.approx(-0.1)


def test_values_replace_the_start_or_the_end_of_a_switch():
    terms = pay(world(10, {"one": 1.0, "two": 7.0}))[2]
    assert terms == pytest.approx({"one": 0.06, "two": 0.7})


def test_single_rows_have_a_pace_of_their_own():
    assert pay(world(4, own={"two": 0.5}))[2]["two"] == 0
    assert pay(world(5, own={"two": 0.5}))[2]["two"] == pytest.approx(-0.1)
    both = pay(world(5, pace=2.0, own={"two": 0.25}))[2]["two"]
    assert both == pytest.approx(-0.1)


@pytest.mark.parametrize("a", [1.0, np.nan, np.inf])
def test_an_invalid_step_pays_nothing_and_counts(a):
    after, reward, terms = pay(world(), valid=False, a=a)
    assert reward == 0 and after.total_steps == 1
    assert terms == {"one": 0.0, "two": 0.0}


def test_a_weight_without_a_row_is_refused():
    with pytest.raises(InputError, match=r"weights\.lfit: .*did you mean lift\?"):
        scheduled_weights(CRAWL, {"lfit": 1.0}, 1.0, {})
    with pytest.raises(InputError, match=r"schedule_scale\.lfit: .*mean lift\?"):
        scheduled_weights(CRAWL, {}, 1.0, {"lfit": 1.0})
