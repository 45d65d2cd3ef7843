"""Measures of a recovery on episodes whose answers are known."""

import jax.numpy as jnp
import numpy as np
import pytest

from envs.tasks.recovery.measures import recovery_measures

STEPS, DT_S = 100, 0.02


def episode(fired=None, settled=None, tilt_deg=3.0, side=0, error_rad=0.25):
    index = np.arange(STEPS)
    steps = {"settling": fired, "settled": settled}
    flags = {k: index >= (STEPS if v is None else v) for k, v in steps.items()}
    recorded = {k: jnp.array(v, jnp.float32) for k, v in flags.items()}
    return recorded | {
        "tilt_rad_v": jnp.full(STEPS, np.radians(tilt_deg)),
        "joint_error_rad": jnp.linspace(1.0, error_rad, STEPS),
        "fall_side": jnp.full(STEPS, side),
        "fall_pose": jnp.full(STEPS, 7),
    }


def measured(recorded, counts=STEPS):
    found = recovery_measures(recorded, jnp.arange(STEPS) < counts, DT_S)
    return {name: float(value) for name, value in found.items()}


@pytest.mark.parametrize(("side", "name"), [(0, "thumb"), (1, "wrist")])
def test_a_hand_that_gets_up_and_settles(side, name):
    found = measured(episode(40, 90, side=side))
    other = {"thumb": "wrist", "wrist": "thumb"}[name]
    for suffix in ("", f"_{name}"):
        assert found[f"righted{suffix}"] == 1.0
        assert found[f"time_to_upright_s{suffix}"] == pytest.approx(0.8)
        assert found[f"final_joint_error_rad{suffix}"] == 0.25
    assert all(np.isnan(v) for k, v in found.items() if k.endswith(other))
    assert found["unit"] == 7
    assert len(found) == 10


def test_a_hand_that_the_detector_never_saw_upright():
    found = measured(episode())
    assert found["righted"] == found["righted_thumb"] == 0.0
    assert np.isnan(found["time_to_upright_s"])
    assert np.isnan(found["final_joint_error_rad"])


def test_a_hand_that_falls_over_while_it_settles_is_not_righted():
    found = measured(episode(40, 90, tilt_deg=12.0))
    assert found["righted"] == 0.0
    assert found["time_to_upright_s"] == pytest.approx(0.8)


def test_a_ramp_that_the_end_of_the_episode_cuts_off_has_no_final_error():
    found = measured(episode(80))
    assert (found["righted"], np.isnan(found["final_joint_error_rad"])) == (1.0, True)


def test_steps_after_the_end_do_not_count():
    assert measured(episode(40, 90), counts=40)["righted"] == 0.0
    assert measured(episode(40, 90), counts=41)["righted"] == 1.0
