import copy

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest

from envs.errors import InputError
from envs.physics.base import PhysicsState
from envs.physics.cpu import CpuPhysics


def plain_loop(mj_model, fields, start, controls, world):
    """mj_step itself, with the state rounded to float32 between control steps."""
    model = copy.copy(mj_model)
    for name, values in fields.items():
        getattr(model, name)[:] = values[world]
    # Set by the compiler where ipos was zero; C MuJoCo would then not read ipos.
    model.body_sameframe[:] = mujoco.mjtSameFrame.mjSAMEFRAME_NONE
    data = mujoco.MjData(model)
    state = [start.qpos[world], start.qvel[world], start.qacc_warmstart[world]]
    rows = []
    for control in controls[:, world]:
        data.qpos, data.qvel, data.qacc_warmstart = state
        for data.ctrl in control:
            mujoco.mj_step(model, data)
        after = (data.qpos, data.qvel, data.qacc_warmstart, data.sensordata)
        rows.append([np.float32(x) for x in after])
        state = rows[-1][:3]
    return [np.stack(x) for x in zip(*rows, strict=True)]


def test_equals_a_loop_of_mj_step_bit_for_bit(
    mj_model, fields, start, controls, roll, cpu_step
):
    output = roll(cpu_step, fields, start, controls)
    batch = jax.tree.leaves((output.state, output.sensordata))
    for world in range(len(start.qpos)):
        loop = plain_loop(mj_model, fields, start, controls, world)
        for x, y in zip(batch, loop, strict=True):
            np.testing.assert_array_equal(x[:, world], y)


def same(a, b):
    leaves = zip(jax.tree.leaves(a), jax.tree.leaves(b), strict=True)
    return all(np.array_equal(x, y) for x, y in leaves)


def test_is_the_same_on_any_number_of_threads(mj_model, fields, start, controls, roll):
    one, two = (
        roll(jax.vmap(CpuPhysics(mj_model, 4, threads).step), fields, start, controls)
        for threads in (1, 2)
    )
    assert same(one, two)


def test_remembers_nothing(fields, start, controls, cpu_step):
    first = cpu_step(fields, start, controls[0])
    other = {**fields, "body_mass": 1.5 * fields["body_mass"]}
    assert not same(cpu_step(other, first.state, controls[1]), first)
    assert same(cpu_step(fields, start, controls[0]), first)


def test_starts_the_solver_from_the_given_warmstart(
    mj_model, fields, start, controls, roll
):
    hasty = copy.copy(mj_model)
    hasty.opt.solver = mujoco.mjtSolver.mjSOL_CG
    hasty.opt.iterations = 2  # so few that the result depends on where it starts
    step = jax.jit(jax.vmap(CpuPhysics(hasty, 4).step))
    # At rest, so that the last acceleration is a better start than none.
    hold = np.zeros_like(controls)
    rest = jax.tree.map(lambda x: x[-1], roll(step, fields, start, hold)).state
    cold = rest.replace(qacc_warmstart=np.zeros_like(rest.qacc_warmstart))
    from_rest = step(fields, rest, hold[0])
    assert not same(from_rest, step(fields, cold, hold[0]))
    assert same(from_rest, step(fields, rest, hold[0]))


def test_alone_under_vmap_and_nested_is_the_same(mj_model, fields, start, controls):
    step = CpuPhysics(mj_model, 4).step
    batch = jax.vmap(step)(fields, start, controls[0])
    nested = jax.vmap(jax.vmap(step))(
        *jax.tree.map(lambda x: x[None], (fields, start, controls[0]))
    )
    alone = step(*jax.tree.map(lambda x: jnp.array(x[1]), (fields, start, controls[0])))
    assert same(jax.tree.map(lambda x: x[0], nested), batch)
    assert same(alone, jax.tree.map(lambda x: x[1], batch))


def test_a_field_common_to_all_worlds_is_not_batched(mj_model, start, controls, roll):
    step = CpuPhysics(mj_model, 4).step
    friction = np.float32(mj_model.geom_friction)
    common = jax.vmap(step, in_axes=({"geom_friction": None}, 0, 0))
    nominal = jax.vmap(step)
    assert same(
        roll(common, {"geom_friction": friction}, start, controls),
        roll(nominal, {}, start, controls),
    )
    assert not same(
        roll(common, {"geom_friction": friction / 2}, start, controls),
        roll(nominal, {}, start, controls),
    )


def test_from_a_gpu_it_is_the_same(
    mj_model, fields, start, controls, cpu_step, monkeypatch
):
    on_cpu = cpu_step(fields, start, controls[0])
    monkeypatch.setattr(jax, "default_backend", lambda: "gpu")
    step = jax.jit(jax.vmap(CpuPhysics(mj_model, 4).step))
    assert "pure_callback" in str(jax.make_jaxpr(step)(fields, start, controls[0]))
    assert same(step(fields, start, controls[0]), on_cpu)


def test_a_world_that_runs_out_of_memory_is_nan_and_alone(
    mj_model, xml, start, controls
):
    spec = mujoco.MjSpec.from_string(xml)
    spec.memory = 8192  # enough for a hand in the air, too little for contacts
    qpos = start.qpos.copy()
    qpos[:, 2] = [0.5, 0.02, 0.5]
    high = start.replace(qpos=qpos)
    output, roomy = (
        jax.vmap(CpuPhysics(model, 4).step)({}, high, controls[0])
        for model in (spec.compile(), mj_model)
    )
    assert np.isnan(output.sensordata[1]).all() and np.isfinite(roomy.sensordata).all()
    others = [jax.tree.map(lambda x: x[::2], o) for o in (output, roomy)]
    assert same(*others)


def test_inertia_that_is_a_constant_of_the_compiler_is_refused():
    loose = mujoco.MjModel.from_xml_string(
        "<mujoco><worldbody><body><freejoint/><geom size='1'/></body></worldbody>"
        "</mujoco>"
    )
    state = PhysicsState(np.float32(loose.qpos0), np.zeros(6), np.zeros(6))
    mass = {"body_mass": np.float32(2 * loose.body_mass)}
    with pytest.raises(InputError, match=r"body_mass.*loose"):
        CpuPhysics(loose, 1).step(mass, state, jnp.zeros((1, 0)))
