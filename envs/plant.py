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

from envs.hand.drive.drive import Drive, DriveState, make_drive
from envs.hand.drive.model_effects import SceneEffects, make_scene_effects
from envs.hand.hand_file import HandFile
from envs.hand.spec import HandSpec, hand_spec
from envs.hand.stance import Stance
from envs.physics.base import ModelFields, Physics, PhysicsOutput, PhysicsState


@dataclass(frozen=True)
class Plant:
    """What an action meets on its way to the next state.

    Attributes:
        mj_model: the scene with the nominal hand.
        spec: indices of the model.
        joint_range: limits of the joints and of their targets [rad].
        physics: backend that steps it.
        drive: what is between the targets and the physics.
        stance: settled stance of the hand.
        rest: the stance with the sensors that belong to it.
        n_substeps: physics steps of a control step.
        effects: effects that act by model and IMU.
    """

    mj_model: mujoco.MjModel
    spec: HandSpec
    joint_range: Float[Array, "joints 2"]
    physics: Physics
    drive: Drive
    stance: Stance
    rest: PhysicsOutput
    n_substeps: int
    effects: SceneEffects

    def next_target(
        self,
        target: Float[Array, " joints"],
        action: Float[Array, " joints"],
        scale_rad: float,
    ) -> Float[Array, " joints"]:
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
        target: Float[Array, " joints"],
    ) -> tuple[DriveState, PhysicsOutput, Bool[Array, ""]]:
        """Advances one control step with the targets held: s' = f(s, target; fields).

        Args:
            fields: what the model of this world differs in.
            state: the state before [m, rad, m/s, rad/s].
            drive: the drive's state before.
            target: joint targets [rad].

        Returns:
            The drive's state, the result, and whether the step was invalid; see
            `replace_invalid`.

        Source:
            MuJoCo documentation, Computation; `Drive` for what is before the physics.
        """

        def exchange(carry: Any, _: None) -> tuple[Any, Array]:
            drive, output = carry
            drive, changed, ctrl = self.drive.act(drive, fields, output.state, target)
            output = self.physics.step(fields | changed, output.state, ctrl)
            return (self.drive.observe(drive, output), output), output.overflow

        begin, rounds = (drive, self.rest.replace(state=state)), self.drive.rounds
        if rounds == 1:
            (drive, output), _ = exchange(begin, None)
        else:
            (drive, output), bits = jax.lax.scan(exchange, begin, length=rounds)
            output = output.replace(overflow=functools.reduce(jnp.bitwise_or, bits))
        return drive, *self.replace_invalid(output)

    def replace_invalid(
        self, output: PhysicsOutput
    ) -> tuple[PhysicsOutput, Bool[Array, ""]]:
        """Replaces a non-finite result: s' ← s' if all finite, else the stance.

        The step then counts as invalid, ends the episode and pays nothing; nothing that
        it computed is used.

        Args:
            output: state and sensors after a step [m, rad, m/s, rad/s].

        Source:
            Ours: one diverged world must not reach the gradients of all.
        """
        leaves = jax.tree.leaves((output.state, output.sensordata))
        finite = jnp.all(jnp.stack([jnp.all(jnp.isfinite(x)) for x in leaves]))
        rest = self.rest.replace(overflow=output.overflow)
        return jax.tree.map(lambda a, b: jnp.where(finite, a, b), output, rest), ~finite


def make_plant(
    make: Callable[[int], Physics],
    model: mujoco.MjModel,
    hand: HandFile,
    stance: Stance,
    n_substeps: int,
) -> Plant:
    """Makes the plant of a scene.

    Args:
        make: makes a backend of this model that does so many physics steps in a call.
        model: the scene, whose hand is built from this file and stance.
        hand: the hand file.
        stance: settled stance of that hand.
        n_substeps: physics steps of a control step.

    Raises:
        InputError: the hand has an effect that it cannot have here.
    """
    drive, spec = make_drive(hand, model, n_substeps), hand_spec(model)
    return Plant(
        mj_model=model,
        spec=spec,
        joint_range=jnp.asarray(spec.joint_range_rad, jnp.float32),
        physics=make(n_substeps // drive.rounds),
        drive=drive,
        stance=stance,
        rest=_output_at_rest(model, stance),
        n_substeps=n_substeps,
        effects=make_scene_effects(hand, model, spec),
    )


def _output_at_rest(model: mujoco.MjModel, stance: Stance) -> PhysicsOutput:
    """The settled stance, the rest of the scene as built, and their sensors."""
    data = mujoco.MjData(model)
    data.qpos[: len(stance.qpos)], data.ctrl[:] = stance.qpos, stance.target_rad
    mujoco.mj_forward(model, data)
    vectors = (data.qpos, np.zeros(model.nv), np.zeros(model.nv), data.sensordata)
    *state, sensordata = (jnp.asarray(x, jnp.float32) for x in vectors)
    return PhysicsOutput(PhysicsState(*state), sensordata, jnp.zeros((), jnp.int32))
