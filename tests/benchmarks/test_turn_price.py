"""What a turn on the spot earns beside standing still."""

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from benchmarks.claims.turn_price import COMMANDS_SEEN, GROWN, Acting, earned, main
from fingers_mjx.evaluation.setups import with_command
from fingers_mjx.policy.actor import Policy
from fingers_mjx.policy.source import load_source
from fingers_mjx.runs.settings import overridden
from fingers_mjx.runs.setup import make_env

POLICY = Path("fingers_mjx/policies/crawl_steering")


def linear(inputs, seen):
    """A policy of one action: the sum of the inputs in `seen`."""
    kernel = np.zeros((inputs, 1))
    kernel[seen] = 1.0
    layers = ((kernel, np.zeros(1)),)
    return Policy(np.zeros(inputs), np.ones(inputs), layers, np.zeros(1), {})


@pytest.mark.parametrize(("stands", "action"), [(False, COMMANDS_SEEN), (True, 0.0)])
def test_a_hand_that_stands_sees_no_command(stands, action):
    network = linear(40, slice(-COMMANDS_SEEN, None))
    obs = {"state": jnp.ones((2, 40))}

    acts = Acting(network, 0.0, stands)(jax.random.key(0), obs)

    np.testing.assert_allclose(acts, action)


def test_a_hand_that_stands_sees_the_rest():
    network = linear(40, slice(0, -COMMANDS_SEEN))
    obs = {"state": jnp.ones((2, 40))}

    acts = Acting(network, 0.0, True)(jax.random.key(0), obs)

    np.testing.assert_allclose(acts, 40 - COMMANDS_SEEN)


@pytest.fixture(scope="module")
def turning():
    """A committed policy that is asked to turn, and two worlds of it."""
    source = load_source(POLICY)
    setup = with_command(overridden(source.setup, GROWN), (0.0, 0.0, 0.45))
    return source.network, make_env(setup, 2, "cpu", auto_reset=False)


def test_terms_add_up_and_turning_is_paid(turning):
    network, batch = turning

    turns, stands = (earned(batch, Acting(network, 0.0, s), 150) for s in (False, True))

    for terms in (turns, stands):
        parts = sum(x for name, x in terms.items() if name != "total")
        assert parts == pytest.approx(terms["total"], abs=1e-2)
    assert turns["track_mean_yaw_rate"] > 2.0 * stands["track_mean_yaw_rate"]
    assert turns["track_planar_velocity"] < stands["track_planar_velocity"]


@pytest.mark.parametrize(
    ("policy", "said"), [("keyboard", "found keyboard"), ("nothing", "nothing")]
)
def test_what_is_no_policy_with_commands_is_refused(capsys, policy, said):
    assert main([str(POLICY.parent / policy)]) == 2
    error = capsys.readouterr().err
    assert error.startswith("turn_price: ") and said in error
