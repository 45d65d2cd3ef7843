import jax
import numpy as np
import pytest

from envs.errors import InputError
from envs.physics.backends import make_physics

pytestmark = pytest.mark.gpu


@pytest.fixture(scope="module")
def warp_step(mj_model):
    return jax.jit(jax.vmap(make_physics("warp", mj_model, 4, 3).step))


def test_warp_and_jax_are_the_same_physics(
    fields, start, controls, roll, jax_step, warp_step, largest_difference
):
    on_jax = roll(jax_step, fields, start, controls)
    on_warp = roll(warp_step, fields, start, controls)
    assert largest_difference(on_jax, on_warp) < 1
    assert not on_warp.overflow.any()

    other = {**fields, "geom_friction": np.roll(fields["geom_friction"], 1, axis=0)}
    on_warp = roll(warp_step, other, start, controls)
    assert largest_difference(on_jax, on_warp) > 10


def test_a_diverged_world_is_nan_and_leaves_the_others(
    fields, start, controls, roll, warp_step, largest_difference
):
    good = roll(warp_step, fields, start, controls[:2])
    qvel = start.qvel.copy()
    qvel[1, 3] = np.nan
    bad = roll(warp_step, fields, start.replace(qvel=qvel), controls[:2])
    assert np.isnan(bad.state.qpos[:, 1]).all()
    rest = (jax.tree.map(lambda x: x[:, [0, 2]], output) for output in (bad, good))
    # Not bit for bit: Warp adds up contact forces in no particular order.
    assert largest_difference(*rest) < 1


@pytest.mark.parametrize("small", ["contacts_per_world", "constraints_per_world"])
def test_buffers_that_are_too_small_are_reported(
    small, mj_model, fields, start, controls, roll
):
    physics = make_physics("warp", mj_model, 4, 3, **{small: 1})
    output = roll(jax.jit(jax.vmap(physics.step)), fields, start, controls)
    assert output.overflow.any()


def test_fields_that_warp_keeps_once_are_refused(mj_model, start, controls):
    physics = make_physics("warp", mj_model, 4, 3)
    contype = {"geom_contype": np.tile(mj_model.geom_contype, (3, 1))}
    with pytest.raises(InputError, match="geom_contype"):
        jax.vmap(physics.step)(contype, start, controls[0])
