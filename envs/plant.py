"""The hand in its physics: drive, varied model, and one control step of one world."""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from jaxtyping import Array, Bool, Float

from envs.errors import InputError
from envs.hand.drive import DriveParams, DriveState, command_sequence, drive_params
from envs.hand.figures import figures
from envs.hand.hand_file import HandFile
from envs.hand.model import PHYSICS_DT_S
from envs.hand.spec import HAND_NQ, HandSpec, hand_spec
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
    """

    mj_model: mujoco.MjModel
    spec: HandSpec
    joint_range: Float[Array, "20 2"]
    physics: Physics
    drive: DriveParams
    stance: Stance
    rest: PhysicsOutput

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
        drive: DriveState,
        target: Float[Array, "20"],
    ) -> tuple[DriveState, PhysicsOutput, Bool[Array, ""]]:
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
        drive, commands = command_sequence(
            self.drive, drive, target, PHYSICS_DT_S, self.physics.n_substeps
        )
        output = self.physics.step(fields, state, commands)
        return drive, *self.replace_invalid(output)

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


def make_plant(physics: Physics, hand: HandFile, stance: Stance) -> Plant:
    """Makes the plant of a scene.

    Args:
        physics: backend with the scene, whose hand is built from this file and stance.
        hand: the hand file.
        stance: settled stance of that hand.
    """
    kp, kv, limit = (figures().per_joint(k) for k in ("kp", "kv", "force_limit"))
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
