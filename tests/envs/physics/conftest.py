"""A floating two-link gripper: every kind of sensor that the environments read."""

import jax
import mujoco
import numpy as np
import pytest

from envs.physics.backends import make_physics
from envs.physics.base import PhysicsState

XML = """
<mujoco>
  <option timestep="0.005" integrator="implicitfast" iterations="30" tolerance="1e-8"/>
  <worldbody>
    <geom name="floor" type="plane" size="0 0 1" friction="0.8"/>
    <body name="palm" pos="0 0 0.06">
      <freejoint/>
      <inertial pos="0 0 0" mass="0.3" diaginertia="3e-4 3e-4 3e-4"/>
      <geom name="palm" type="sphere" size="0.03"/>
      <site name="imu" pos="0.01 0 0"/>
      <body name="upper" pos="0.05 0 0">
        <joint name="abduct" axis="0 0 1" range="-60 60" damping="0.01"/>
        <geom name="upper" type="capsule" fromto="0 0 0 0.06 0 0" size="0.01"
          mass="0.05"/>
        <body name="lower" pos="0.06 0 0">
          <joint name="flex" axis="0 1 0" range="-30 80" damping="0.01"/>
          <geom name="lower" type="capsule" fromto="0 0 0 0.05 0 0" size="0.01"
            mass="0.03"/>
          <geom name="tip" type="sphere" pos="0.06 0 0" size="0.012" mass="0.01"/>
          <site name="tip" pos="0.06 0 0"/>
        </body>
      </body>
    </body>
  </worldbody>
  <contact>
    <exclude body1="palm" body2="upper"/>
    <exclude body1="palm" body2="lower"/>
  </contact>
  <actuator>
    <position name="abduct" joint="abduct" kp="2" kv="0.05" forcerange="-0.5 0.5"/>
    <position name="flex" joint="flex" kp="2" kv="0.05" forcerange="-0.5 0.5"/>
  </actuator>
  <sensor>
    <framepos objtype="site" objname="tip"/>
    <framequat objtype="site" objname="imu"/>
    <framelinvel objtype="site" objname="tip"/>
    <frameangvel objtype="site" objname="imu"/>
    <gyro site="imu"/>
    <actuatorfrc name="flex" actuator="flex"/>
    <jointactuatorfrc joint="abduct"/>
    <contact name="tip" geom1="floor" geom2="tip" data="found force" reduce="mindist"/>
    <contact geom1="floor" geom2="lower" data="found force" reduce="mindist" num="2"/>
    <contact geom1="floor" geom2="palm" data="found force" reduce="mindist"/>
  </sensor>
</mujoco>
"""

N_SUBSTEPS = 4
N_WORLDS = 3


@pytest.fixture(scope="session")
def xml():
    return XML


@pytest.fixture(scope="session")
def mj_model():
    return mujoco.MjModel.from_xml_string(XML)


@pytest.fixture
def rng(request):
    seed = 20
    print(f"{request.node.name}: seed {seed}")
    return np.random.default_rng(seed)


@pytest.fixture
def fields(mj_model, rng):
    """A different hand in each world: what domain randomization changes."""

    def scaled(name):
        nominal = getattr(mj_model, name)
        shape = (N_WORLDS, len(nominal)) + (1,) * (nominal.ndim - 1)
        return (nominal * rng.uniform(0.7, 1.3, shape)).astype(np.float32)

    mass = scaled("body_mass")
    gain = scaled("actuator_gainprm")
    bias = np.tile(mj_model.actuator_biasprm.astype(np.float32), (N_WORLDS, 1, 1))
    bias[:, :, 1] = -gain[:, :, 0]
    ipos = np.tile(mj_model.body_ipos.astype(np.float32), (N_WORLDS, 1, 1))
    ipos[:, 1] = rng.uniform(-0.01, 0.01, (N_WORLDS, 3))
    return {
        "body_mass": mass,
        "body_subtreemass": np.cumsum(mass[:, ::-1], axis=1)[:, ::-1],
        "body_inertia": scaled("body_inertia"),
        "body_ipos": ipos,
        "geom_friction": scaled("geom_friction"),
        "actuator_gainprm": gain,
        "actuator_biasprm": bias,
        "actuator_forcerange": scaled("actuator_forcerange"),
    }


@pytest.fixture
def start(mj_model, rng):
    qpos = np.tile(mj_model.qpos0, (N_WORLDS, 1))
    qpos[:, 2] = 0.04
    qpos[:, 7:] = rng.uniform(-0.3, 0.3, (N_WORLDS, 2))
    qvel = rng.normal(0, 0.1, (N_WORLDS, mj_model.nv))
    zero = np.zeros_like(qvel)
    return PhysicsState(*(np.float32(x) for x in (qpos, qvel, zero)))


@pytest.fixture
def controls(mj_model, rng):
    """Twelve control steps, other controls in each substep; some saturate a drive."""
    shape = (12, N_WORLDS, N_SUBSTEPS, mj_model.nu)
    return rng.normal(0, 0.5, shape).astype(np.float32)


@pytest.fixture(scope="session")
def roll():
    """Returns the outputs of all control steps, stacked along time."""

    def run(step, fields, state, controls):
        outputs = []
        for control in controls:
            outputs.append(step(fields, state, control))
            state = outputs[-1].state
        return jax.tree.map(lambda *x: np.stack(x), *outputs)

    return run


@pytest.fixture(scope="session")
def jax_step(mj_model):
    """The jax backend, compiled once for all tests."""
    physics = make_physics("jax", mj_model, N_SUBSTEPS, N_WORLDS)
    return jax.jit(jax.vmap(physics.step))


@pytest.fixture
def cpu_step(mj_model):
    physics = make_physics("cpu", mj_model, N_SUBSTEPS, N_WORLDS)
    return jax.jit(jax.vmap(physics.step))


@pytest.fixture(scope="session")
def largest_difference():
    """Returns how far two rollouts are apart, in units of what float32 may do.

    float32 carries 6e-8 of relative error per operation; a contact of solref 0.02 s
    over twelve control steps and the solver's tolerance make that some 1e-6 m, rad in
    positions. The bound leaves a factor of fifty: 1e-4 in positions and 5e-3 in
    velocities and sensors (N, N m, m/s), whose scale is 1 to 20.
    """

    def difference(a, b):
        return max(
            np.abs(a.state.qpos - b.state.qpos).max() / 1e-4,
            np.abs(a.state.qvel - b.state.qvel).max() / 5e-3,
            np.abs(a.sensordata - b.sensordata).max() / 5e-3,
        )

    return difference
