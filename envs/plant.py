"""The hand in its physics: drive, varied model, and one control step of one world."""

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from jaxtyping import Array, Bool, Float

from envs.errors import InputError
from envs.hand.drive.chain import (
    Chain,
    ChainState,
    begin_chain,
    chain_substep,
    make_chain,
    read_load,
)
from envs.hand.drive.model_effects import SceneEffects, make_scene_effects
from envs.hand.drive.servo import (
    DriveParams,
    DriveState,
    command_sequence,
    drive_params,
    init_drive_state,
)
from envs.hand.hand_file import HandFile
from envs.hand.model import PHYSICS_DT_S
from envs.hand.spec import HAND_NQ, JOINT_QPOS, HandSpec, hand_spec
from envs.hand.stance import Stance
from envs.physics import ModelFields, Physics, PhysicsOutput, PhysicsState


@dataclass(frozen=True)
class Plant:
    """What an action meets on its way to the next state.

    Attributes:
        mj_model: the scene with the nominal hand.
        spec: indices of the model.
        joint_range: limits of the joints and of their targets [rad].
        physics: backend that steps it.
        drive: parameters of the command path.
        stance: settled stance of the hand.
        rest: the stance with the sensors that belong to it.
        n_substeps: physics steps of a control step.
        chain: the drive of a hand with effects of joints, in the place of `drive` and
            of MuJoCo's servos; none for other hands.
        effects: effects that act by model and IMU.
    """

    mj_model: mujoco.MjModel
    spec: HandSpec
    joint_range: Float[Array, "20 2"]
    physics: Physics
    drive: DriveParams
    stance: Stance
    rest: PhysicsOutput
    n_substeps: int
    chain: Chain | None
    effects: SceneEffects

    def next_target(
        self,
        target: Float[Array, "20"],
        action: Float[Array, "20"],
        scale_rad: float,
    ) -> Float[Array, "20"]:
        """Target ← clip(target + α tanh(a), joint limits) [rad].

        Args:
            target: joint targets before [rad].
            action: clipped policy output a.
            scale_rad: α, the increment at full action [rad].

        Source:
            Paper, policy interfaces.
        """
        moved = target + scale_rad * jnp.tanh(action)
        return jnp.clip(moved, self.joint_range[:, 0], self.joint_range[:, 1])

    def step(
        self,
        fields: ModelFields,
        state: PhysicsState,
        drive: DriveState | ChainState,
        target: Float[Array, "20"],
    ) -> tuple[DriveState | ChainState, PhysicsOutput, Bool[Array, ""]]:
        """Advances one control step with the joint targets held.

        Args:
            fields: what the model of this world differs in.
            state: the state before.
            drive: the drive's state before.
            target: joint targets [rad].

        Returns:
            The drive's state, the result, and whether the step was invalid; see
            `replace_invalid`.
        """
        if isinstance(drive, ChainState):
            drive, output = self._step_chained(fields, state, drive, target)
        else:
            drive, commands = self.commands(drive, target)
            output = self.physics.step(fields, state, commands)
        return drive, *self.replace_invalid(output)

    def begin_drive(
        self, target: Float[Array, "20"], state: PhysicsState
    ) -> DriveState | ChainState:
        """The drive at rest: `target` [rad] has been sent for long."""
        if self.chain is not None:
            return begin_chain(self.chain, target, state.qpos[JOINT_QPOS])
        return init_drive_state(target, self.drive, PHYSICS_DT_S)

    def commands(
        self, drive: DriveState, target: Float[Array, "20"]
    ) -> tuple[DriveState, Float[Array, "n 20"]]:
        """Commands of a control step to MuJoCo's servos, one per substep [rad]."""
        return command_sequence(
            self.drive, drive, target, PHYSICS_DT_S, self.n_substeps
        )

    def begin_substep(
        self,
        fields: ModelFields,
        state: PhysicsState,
        drive: ChainState,
        target: Float[Array, "20"],
    ) -> tuple[ChainState, ModelFields]:
        """Runs the chain for one substep; returns the fields that apply its torques."""
        assert self.chain is not None
        return chain_substep(self.chain, fields, self.mj_model, drive, state, target)

    def end_substep(self, drive: ChainState, output: PhysicsOutput) -> ChainState:
        """Tells the chain what the physics made of a substep."""
        assert self.chain is not None
        return read_load(self.chain, self.spec, drive, output)

    def joint_reading(
        self, drive: DriveState | ChainState, state: PhysicsState
    ) -> Float[Array, "20"]:
        """Joint angles that the encoders tell the host [rad]."""
        if isinstance(drive, ChainState):
            return drive.reading
        return state.qpos[JOINT_QPOS]

    def _step_chained(
        self,
        fields: ModelFields,
        state: PhysicsState,
        drive: ChainState,
        target: Float[Array, "20"],
    ) -> tuple[ChainState, PhysicsOutput]:
        """A control step in which the chain runs between the substeps."""

        def substep(carry: Any, _: None) -> tuple[Any, Array]:
            drive, output = carry
            drive, applied = self.begin_substep(fields, output.state, drive, target)
            output = self.physics.step(applied, output.state, jnp.zeros((1, 20)))
            return (self.end_substep(drive, output), output), output.overflow

        start = (drive, self.rest.replace(state=state))
        (drive, output), overflow = jax.lax.scan(substep, start, length=self.n_substeps)
        any_overflow = functools.reduce(jnp.bitwise_or, overflow)
        return drive, output.replace(overflow=any_overflow)

    def replace_invalid(
        self, output: PhysicsOutput
    ) -> tuple[PhysicsOutput, Bool[Array, ""]]:
        """Puts the stance in the place of a non-finite result, which ends the episode.

        The step counts as invalid and pays nothing; nothing that it computed is used.
        """
        leaves = jax.tree.leaves((output.state, output.sensordata))
        finite = jnp.all(jnp.stack([jnp.all(jnp.isfinite(x)) for x in leaves]))
        rest = self.rest.replace(overflow=output.overflow)
        return jax.tree.map(lambda a, b: jnp.where(finite, a, b), output, rest), ~finite


def make_plant(
    make: Callable[[int], Physics], hand: HandFile, stance: Stance, n_substeps: int
) -> Plant:
    """Makes the plant of a scene.

    Args:
        make: makes a backend that does so many physics steps in a call, with the scene,
            whose hand is built from this file and stance.
        hand: the hand file.
        stance: settled stance of that hand.
        n_substeps: physics steps of a control step.

    Raises:
        InputError: the hand has an effect that it cannot have here.
    """
    chain = make_chain(hand, PHYSICS_DT_S)
    physics = make(n_substeps if chain is None else 1)
    kp, kv, limit = (hand.nominal.per_joint(k) for k in ("kp", "kv", "force_limit"))
    drive = drive_params(hand, kp, kv, limit)
    spec = hand_spec(physics.mj_model)
    return Plant(
        mj_model=physics.mj_model,
        spec=spec,
        joint_range=jnp.asarray(spec.joint_range_rad, jnp.float32),
        physics=physics,
        drive=jax.tree.map(lambda x: jnp.asarray(x, jnp.float32), drive),
        stance=stance,
        rest=_output_at_rest(physics.mj_model, stance),
        n_substeps=n_substeps,
        chain=chain,
        effects=make_scene_effects(hand, physics.mj_model, spec),
    )


def check_interval(control_dt_s: float) -> None:
    """Checks that a control interval is a whole number of physics steps.

    Raises:
        InputError: it is not, or is shorter than one.
    """
    substeps = control_dt_s / PHYSICS_DT_S
    if round(substeps) < 1 or abs(substeps - round(substeps)) > 1e-6:
        valid = f"a multiple of {PHYSICS_DT_S:g} s, the physics step"
        raise InputError("configuration", "control_dt_s", control_dt_s, valid)


def _output_at_rest(model: mujoco.MjModel, stance: Stance) -> PhysicsOutput:
    """The settled stance, the rest of the scene as built, and their sensors."""
    data = mujoco.MjData(model)
    data.qpos[:HAND_NQ], data.ctrl[:] = stance.qpos, stance.target_rad
    mujoco.mj_forward(model, data)
    vectors = (data.qpos, np.zeros(model.nv), np.zeros(model.nv), data.sensordata)
    *state, sensordata = (jnp.asarray(x, jnp.float32) for x in vectors)
    return PhysicsOutput(PhysicsState(*state), sensordata, jnp.zeros((), jnp.int32))
