"""A hand with effects moves alike on the backends."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from support import effects_hand as rig

STEPS = 5
EFFECTS = (
    rig.entry("backlash", ("index",), gap_rad=0.03),
    rig.entry("load_friction", drive_share=0.2, load_share=0.2),
    rig.entry("compliance", ("dip",)),
    rig.entry("floor_tilt", roll_rad=0.05),
    rig.entry("friction_anisotropy", split=0.3),
    rig.entry("payload_mass", mass_kg=0.05),
)


def motion(env):
    """Joint angles and load of control steps with targets that jump, [T, 20]."""
    world = env.reset(jax.random.key(0)).memory.world
    fields, start = env.fields(world), env.plant.rest.state
    target = jnp.array(env.stance.target_rad) + 0.05 * jnp.sin(jnp.arange(20.0))

    def step(carry, _):
        drive, data = carry
        drive, output, _ = env.plant.step(fields, data, drive, target)
        return (drive, output.state), (output.state.qpos[7:], drive.load)

    stand = jnp.array(env.stance.target_rad)
    first = (env.plant.drive.begin(stand, start.qpos[7:]), start)
    return jax.jit(lambda: jax.lax.scan(step, first, length=STEPS)[1])()


@pytest.mark.slow
def test_a_hand_with_effects_moves_alike_in_mjx_and_in_c():
    cpu, mjx = (motion(rig.env_with(*EFFECTS, backend=b)) for b in ("cpu", "jax"))
    plain = motion(rig.env_with(*EFFECTS[1:2], backend="cpu"))
    moved = np.max(np.abs(cpu[0] - cpu[0][0]))
    assert moved > 0.01
    assert np.max(np.abs(mjx[0] - cpu[0])) < 0.03 * moved
    assert np.max(np.abs(mjx[1] - cpu[1])) < 0.1 * np.max(np.abs(cpu[1]))
    assert np.max(np.abs(plain[0] - cpu[0])) > 0.1 * moved
