"""What holds for every effect of the catalogue."""

import math
import pkgutil

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from support import effects_rig as rig

import envs.actuator.effects
from envs.actuator.catalogue import CATALOGUE, effect_kind
from envs.actuator.chain import JointInput, chain_step, init_states
from envs.actuator.effect import Stage, Substep
from envs.actuator.joint import joint_step
from envs.actuator.surroundings import ALONE
from envs.errors import InputError

IDENTIFIERS = [
    "transport_delay",
    "lowpass_cutoff",
    "command_quantization",
    "slew_limit",
    "directional_slew",
    "acceleration_limit",
    "torque_slope_limit",
    "stiffness",
    "damping",
    "deadband",
    "start_torque",
    "torque_limit",
    "thermal_derating",
    "supply_sag",
    "backlash",
    "compliance",
    "hysteresis",
    "joint_coupling",
    "coulomb_friction",
    "asymmetric_friction",
    "viscous_friction",
    "asymmetric_viscous",
    "stribeck_friction",
    "load_friction",
    "armature",
    "encoder_offset",
    "encoder_scale",
    "encoder_eccentricity",
    "sensor_latency",
    "clock_drift",
    "payload_mass",
    "payload_com",
    "mount_tilt",
    "floor_tilt",
    "tip_friction",
    "friction_anisotropy",
    "finger_weakness",
    "imu_bias",
    "imu_misalignment",
]
SPRINGS = {"hysteresis", "joint_coupling"}
PASSIVE = tuple(
    n for n, k in CATALOGUE.items() if Stage.FRICTION in k.acts and n not in SPRINGS
)
EVERY = pytest.mark.parametrize("name", CATALOGUE)
JOINT = tuple(name for name, kind in CATALOGUE.items() if kind.acts)
SEED = 20261121


def present(name):
    """Parameters at which an effect shows: those of the prior, off the identity."""
    if name == "clock_drift":  # a record of these tests is short
        return {"drift_ppm": 2000.0}
    found = {}
    for key, p in CATALOGUE[name].parameters.items():
        grown = p.prior.kind == "lognormal" and p.prior.center == p.identity
        moved = p.prior.center * p.prior.spread if grown else p.prior.center
        found[key] = p.prior.spread if p.prior.kind == "normal" else moved
    return found


def wave():
    """A target with fast and slow parts, large enough for every limit to act."""
    print(f"seed {SEED}")
    rng = np.random.default_rng(SEED)
    t = np.arange(400) * rig.DT
    steps = np.repeat(rng.uniform(-1.0, 1.0, 8), 50)
    return steps + 0.1 * np.sin(40.0 * t)


LOAD = 0.05


def test_names_and_files():
    modules = {m.name for m in pkgutil.iter_modules(envs.actuator.effects.__path__)}
    parts = {"base", "chain", "joint", "catalogue", "surroundings"}
    assert modules - parts == set(CATALOGUE) == set(IDENTIFIERS)
    with pytest.raises(InputError, match="did you mean backlash"):
        effect_kind("backlas")


@EVERY
def test_parameters_are_whole(name):
    kind = CATALOGUE[name]
    assert any(p.identity is not None for p in kind.parameters.values())
    for p in kind.parameters.values():
        assert p.low <= p.prior.center <= p.high
        assert p.prior.spread > (1.0 if p.prior.kind == "lognormal" else 0.0)
        assert p.identity in (None, math.inf) or p.low <= p.identity <= p.high
    assert kind.source
    assert kind.equation
    assert kind.acts or kind.changes_model or kind.senses
    assert set(kind.confusable_with) <= set(IDENTIFIERS) - {name}
    assert set(present(name)) == set(kind.identity()) == set(kind.units())


def test_confusion_is_mutual():
    """What can be taken for another can also be mistaken for by it."""
    pairs = {(a, b) for a, k in CATALOGUE.items() for b in k.confusable_with}
    inside = {(a, b) for a, b in pairs if b in CATALOGUE}
    assert inside == {(b, a) for a, b in inside}


def both(name, scale):
    """The identity for a first joint, the effect at its prior's size for a second.

    Parameters that only shape the effect take the scaled median of their prior.
    """
    kind, shown = CATALOGUE[name], present(name)
    values = {
        key: (scale * shown[key] if p.identity is None else p.identity, shown[key])
        for key, p in kind.parameters.items()
    }
    return {key: np.array(pair, np.float32) for key, pair in values.items()}


def far(a, b, size):
    """Whether signals differ by more than rounding and the order of sums explain."""
    pairs = zip(jax.tree.leaves(a), jax.tree.leaves(b), strict=True)
    finite = ((np.where(np.isinf(v), 0.0, v) for v in pair) for pair in pairs)
    return any(
        np.max(np.abs(x - y)) > size * max(1e-3, np.max(np.abs(y))) for x, y in finite
    )


@pytest.mark.parametrize("name", JOINT)
def test_identity_changes_nothing_and_joints_are_alone(name):
    """The second joint is the first one's negative control; then they change places."""
    twice = np.stack([wave(), wave()], 1)
    plain = rig.run({}, twice, LOAD)
    for scale in (1.0, 3.0):
        values = both(name, scale)
        found = rig.run({name: values}, twice, LOAD)
        assert not far(joint(found, 0), joint(plain, 0), 1e-4)
        assert far(joint(found, 1), joint(plain, 1), 1e-3)
        turned = {key: pair[::-1] for key, pair in values.items()}
        swapped = rig.run({name: turned}, twice, LOAD)
        assert not far(joint(swapped, 0), joint(found, 1), 1e-6)
        assert not far(joint(swapped, 1), joint(found, 0), 1e-6)


def joint(signals, i):
    return jax.tree.map(lambda x: x[:, i], signals)


@pytest.mark.parametrize("name", JOINT)
def test_gradients_are_finite(name):
    """Of all signals after two substeps, with respect to the parameters."""
    kind = CATALOGUE[name]

    def total(params):
        model, q, v = ((kind, params),), jnp.asarray(0.1), jnp.asarray(0.5)
        states = init_states(model, q, q, rig.DT)
        around = jax.tree.map(jnp.asarray, rig.AROUND)
        for target in (0.1, 0.3):
            joint = JointInput(jnp.asarray(target), q, v, LOAD, 2.0, 0.05, around)
            states, x = chain_step(model, states, joint, rig.DT)
            q, v = joint_step(x, jnp.asarray(rig.INERTIA), rig.DT)
        return sum(jnp.sum(leaf) for leaf in jax.tree.leaves((q, v, x)))

    slopes = jax.grad(total)({k: jnp.asarray(v) for k, v in present(name).items()})
    assert all(np.isfinite(s) for s in slopes.values())


@pytest.mark.parametrize("name", PASSIVE)
def test_friction_only_takes_energy(name):
    """A free joint never gets faster, at any size and any step; no drive, no load."""
    rng = np.random.default_rng(SEED)
    print(f"seed {SEED}")
    ranges = CATALOGUE[name].parameters.values()
    values = {k: 0.0 for k in CATALOGUE[name].parameters}
    for _ in range(20):
        for key, p in zip(values, ranges, strict=True):
            low = max(p.low, 1e-4 * p.high)
            values[key] = low * (p.high / low) ** rng.uniform()
        speed = rng.uniform(-30.0, 30.0)
        _, v, x = rig.run({name: values}, np.zeros(50), v0=speed, kp=0.0, kd=0.0)
        energy = np.append(speed, v) ** 2
        assert np.all(np.diff(energy) <= 1e-6 * energy[0])
        assert np.all(v * speed >= 0.0)
        assert np.all(x.friction >= 0.0)
        assert np.all(x.viscous >= 0.0)


def test_negative_friction_would_be_seen():
    """Negative control of the test above."""
    _, v, _ = rig.run(
        {"viscous_friction": {"damping_nms": -0.01}}, np.zeros(50), v0=1.0, kp=0, kd=0
    )
    assert np.all(np.diff(v) > 0.0)


def test_signals_are_all_set():
    """The chain hands the physics one number per joint in every signal."""
    zero = jnp.zeros(3)
    _, x = chain_step((), (), JointInput(zero, zero, zero), rig.DT)
    assert isinstance(x, Substep)
    signals = {k: v for k, v in vars(x).items() if k != "around"}
    assert {leaf.shape for leaf in jax.tree.leaves(signals)} == {(3,)}


def test_an_effect_without_its_surroundings_is_refused():
    for name in ("joint_coupling", "payload_mass", "mount_tilt"):
        with pytest.raises(InputError, match=name):
            rig.run({name: present(name)}, np.zeros(3), around=ALONE)
    alone = rig.run({"supply_sag": {"sag_per_nm": 0.5}}, rig.jump(0.3, 0.1))
    more = rig.run(
        {"supply_sag": {"sag_per_nm": 0.5}}, rig.jump(0.3, 0.1), around=ALONE
    )
    assert np.max(np.abs(alone[0] - more[0])) > 1e-3
