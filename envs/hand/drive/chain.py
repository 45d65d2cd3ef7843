"""The drive of a hand with effects of joints: the whole chain outside of MuJoCo.

Every substep the chain that identification fits computes each joint's torque, friction
and damping from target, angle and speed; the actuators of the physics only apply them.
"""

from dataclasses import dataclass
from typing import Any

import flax.struct
import jax.numpy as jnp
import mujoco
import numpy as np
from jaxtyping import Array, Float

from envs.actuator.catalogue import CATALOGUE
from envs.actuator.chain import JointInput, chain_step, init_states
from envs.actuator.effect import EffectKind, Params, Substep
from envs.actuator.surroundings import Surroundings
from envs.hand.effect_parts import load_sensor
from envs.hand.hand_file import HandFile
from envs.hand.places import joints_at
from envs.hand.spec import HandSpec, hand_spec
from envs.physics.base import ModelFields, PhysicsOutput, PhysicsState

LIMIT = "torque_limit"
_UNLIMITED_NM = 1e6


@flax.struct.dataclass
class ChainState:
    """What the chain carries from substep to substep.

    Attributes:
        effects: states of the effects.
        reading: joint angles as the host reads them [rad].
        effort: torques of the motors in the last substep [N·m].
        load: torques of the links on the joints in the last substep [N·m].
    """

    effects: tuple[Any, ...]
    reading: Float[Array, "*b joints"]
    effort: Float[Array, "*b joints"]
    load: Float[Array, "*b joints"]


@dataclass(frozen=True)
class ChainDrive:
    """`envs.hand.drive.drive.Drive` as a tuple of effects.

    Attributes:
        kinds: the command path and the limit of every hand, and its own effects, in the
            order of the catalogue.
        params: their parameters per joint; where a hand does not have an effect,
            those at which it vanishes. The limit takes its own from the model.
        other: index of the joint that each joint is coupled to.
        load_sensors: where the sensors report the torques of the links on the joints;
            none if no effect depends on them.
        nominal: the model, for fields that are not given.
        spec: its indices.
        n_substeps: physics steps of a control step.
        dt: substep [s].
    """

    kinds: tuple[EffectKind, ...]
    params: tuple[Params, ...]
    other: tuple[int, ...]
    load_sensors: tuple[slice, ...]
    nominal: mujoco.MjModel
    spec: HandSpec
    n_substeps: int
    dt: float

    @property
    def rounds(self) -> int:
        """One in each substep: torques depend on angle and speed."""
        return self.n_substeps

    def begin(
        self, target: Float[Array, " joints"], q: Float[Array, " joints"]
    ) -> ChainState:
        """The chain at rest, in which no signal changes: ẋ = 0.

        Args:
            target: joint targets that have been sent since t = −∞ [rad].
            q: joint angles [rad].

        Source:
            Ours: an episode starts without a transient of filters.
        """
        none = jnp.zeros(q.shape)
        model = self._model(jnp.inf * jnp.ones(q.shape))
        states = init_states(model, target, q, self.dt)
        rest = ChainState(effects=states, reading=q, effort=none, load=none)
        joint = JointInput(target, q, none, around=self._around(rest, q))
        x = chain_step(model, states, joint, self.dt)[1]
        return rest.replace(reading=x.reading)

    def act(
        self,
        drive: ChainState,
        fields: ModelFields,
        state: PhysicsState,
        target: Float[Array, " joints"],
    ) -> tuple[ChainState, ModelFields, Float[Array, "1 joints"]]:
        """Runs `chain_step` for one substep: (x, target, q, q̇) ↦ (x', τ, F, b, d, I).

        Args:
            drive: state of the chain, x.
            fields: model fields of this world; kp [N·m/rad], kd [N·m·s/rad] and limits
                [N·m] of its drives among them.
            state: state of the physics before the substep.
            target: joint targets [rad].

        Returns:
            The new state, the fields under which the physics applies drive torque τ,
            friction F, viscosity b, damping d and inertia I, and controls that have no
            effect.

        Source:
            Ours: the chain of identification and the one of training are the same code.
        """
        qpos, qvel = self.spec.joint_qpos, self.spec.joint_qvel
        q, qd = state.qpos[qpos], state.qvel[qvel]
        gain, bias = (fields[f"actuator_{name}prm"] for name in ("gain", "bias"))
        model = self._model(fields["actuator_forcerange"][:, 1])
        rotor = jnp.asarray(self.nominal.dof_armature[qvel], jnp.float32)
        around = self._around(drive, q).replace(inertia=rotor)
        joint = JointInput(target, q, qd, drive.load, gain[:, 0], -bias[:, 2], around)
        states, x = chain_step(model, drive.effects, joint, self.dt)
        drive = drive.replace(effects=states, reading=x.reading, effort=x.effort)
        changed = _applied(fields, self.nominal, qvel, x)
        return drive, changed, jnp.zeros((1, q.size))

    def observe(self, drive: ChainState, output: PhysicsOutput) -> ChainState:
        """Takes the load on the joints from the sensors of the last substep."""
        if not self.load_sensors:
            return drive
        held = [output.sensordata[at][1] for at in self.load_sensors]
        return drive.replace(load=-jnp.stack(held))

    def reading(
        self, drive: ChainState, q: Float[Array, " joints"]
    ) -> Float[Array, " joints"]:
        """What the chain computed in its last substep, old and with encoder errors.

        y = x.reading of `chain_step` [rad].

        Source:
            Ours: see `Stage.READING` of the actuator chain.
        """
        return drive.reading

    def _model(self, limit_nm: Array) -> tuple[tuple[EffectKind, Params], ...]:
        """The effects with parameters; the first torque limit is that of the model."""
        first = next(i for i, kind in enumerate(self.kinds) if kind.name == LIMIT)
        params = list(self.params)
        params[first] = {"limit_nm": limit_nm}
        return tuple(zip(self.kinds, params, strict=True))

    def _around(self, drive: ChainState, q: Float[Array, " joints"]) -> Surroundings:
        """What the other joints did in the last substep."""
        size, other = jnp.abs(drive.effort), jnp.array(self.other)
        return Surroundings(
            others_nm=jnp.sum(size) - size,
            other_q=q[other],
            other_nm=drive.effort[other],
        )


def chain_drive(
    hand: HandFile, model: mujoco.MjModel, n_substeps: int, dt: float
) -> ChainDrive | None:
    """Makes the chain of a hand; none if MuJoCo's position servo is all of its drive.

    Args:
        hand: the hand file.
        model: the scene with this hand.
        n_substeps: physics steps of a control step.
        dt: substep of the physics [s].
    """
    own = {e.name for e in hand.effects if in_chain(CATALOGUE[e.name])}
    if not own:
        return None
    count = len(hand.nominal.links)
    base = {
        "transport_delay": {"delay_s": np.full(count, hand.delay_s.value)},
        "lowpass_cutoff": {"cutoff_hz": np.full(count, hand.lowpass_hz.value)},
        "slew_limit": {"speed_rad_s": hand.per_joint("speed_limit")},
        LIMIT: {"limit_nm": np.full(count, np.inf)},
    }
    links = []
    for name, kind in CATALOGUE.items():
        links += [(kind, base[name])] if name in base else []
        links += [(kind, joint_params(hand, name))] if name in own else []
    spec = hand_spec(model)
    uses_load = any(kind.uses_load for kind, _ in links)
    return ChainDrive(
        kinds=tuple(kind for kind, _ in links),
        params=tuple(float32(params) for _, params in links),
        other=_others(hand),
        load_sensors=tuple(
            spec.sensors[load_sensor(n)] for n in spec.joints if uses_load
        ),
        nominal=model,
        spec=spec,
        n_substeps=n_substeps,
        dt=dt,
    )


def in_chain(kind: EffectKind) -> bool:
    """Whether an effect acts in the chain of a hand, and not by the physics model."""
    return bool(kind.acts) and kind.changes_model is None


def joint_params(hand: HandFile, name: str) -> dict[str, Float[np.ndarray, " joints"]]:
    """Parameters of an effect per joint; elsewhere the values at which it vanishes.

    θ_j = the file's value where the hand has the effect, else the identity's, in the
    unit of `Parameter.unit` [N·m, rad, s, 1, …].

    Args:
        hand: the hand file.
        name: of an effect in the catalogue.

    Source:
        Ours: one program runs all joints, with or without the effect.
    """
    count = len(hand.nominal.links)
    found = {k: np.full(count, v) for k, v in CATALOGUE[name].identity().items()}
    for effect in hand.effects:
        if effect.name == name:
            at = list(joints_at(hand.nominal, effect.where))
            for key, quantity in effect.parameters.items():
                found[key][at] = quantity.value
    return found


def _applied(
    fields: ModelFields, nominal: mujoco.MjModel, joints: slice, x: Substep
) -> ModelFields:
    """Model fields that make the physics apply the signals of a substep.

    The actuator's force is τ − d (q̇' − q̇), with the damping d taken implicitly.
    """

    def given(name: str) -> Array:
        return jnp.asarray(fields.get(name, getattr(nominal, name)), jnp.float32)

    bias = jnp.zeros_like(given("actuator_biasprm"))
    constant = x.torque + x.passive + x.damping * x.qd
    armature = given("dof_armature")
    changed = {
        "actuator_gainprm": jnp.zeros_like(given("actuator_gainprm")),
        "actuator_biasprm": bias.at[:, 0].set(constant).at[:, 2].set(-x.damping),
        "actuator_forcerange": jnp.broadcast_to(
            jnp.array([-_UNLIMITED_NM, _UNLIMITED_NM]), (nominal.nu, 2)
        ),
        "dof_damping": given("dof_damping").at[joints].add(x.viscous),
        "dof_armature": jnp.maximum(armature.at[joints].add(x.inertia), 0.0),
    }
    if np.any(nominal.dof_frictionloss[joints] > 0.0):
        friction = given("dof_frictionloss").at[joints].add(x.friction)
        changed["dof_frictionloss"] = friction
    return changed


def _others(hand: HandFile) -> tuple[int, ...]:
    """Partner of each joint; its own index where there is none."""
    other = list(range(len(hand.nominal.links)))
    for effect in hand.effects:
        if effect.other:
            for joint in joints_at(hand.nominal, effect.where):
                other[joint] = joints_at(hand.nominal, (effect.other,))[0]
    return tuple(other)


def float32(params: dict[str, Float[np.ndarray, "..."]]) -> Params:
    """Parameters as JAX computes with them: x ← x in single precision [N·m, 1, …].

    Source:
        Ours: states are float32, and no parameter may promote them.
    """
    return {key: jnp.asarray(value, jnp.float32) for key, value in params.items()}
