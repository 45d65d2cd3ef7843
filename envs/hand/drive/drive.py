"""What drives the joints of a simulated hand: one protocol with two implementations."""

from typing import Any, Protocol

import mujoco
from jaxtyping import Array, Float

from envs.hand.drive.chain import ChainState, chain_drive
from envs.hand.drive.servo import CommandState, servo_drive
from envs.hand.hand_file import HandFile
from envs.hand.model import PHYSICS_DT_S
from envs.physics.base import ModelFields, PhysicsOutput, PhysicsState

DriveState = CommandState | ChainState


class Drive(Protocol):
    """From joint targets to what the physics applies, and back to what a host reads.

    A control step consists of `rounds` equal rounds: `act`, a call of the physics under
    the returned fields and controls, `observe`. The drive's state is a pytree.
    """

    @property
    def rounds(self) -> int:
        """How often in a control step the drive acts on the state of the physics."""
        ...

    def begin(self, target: Float[Array, " joints"], q: Float[Array, " joints"]) -> Any:
        """The state of a drive at rest, in which nothing changes: ẋ = 0.

        Args:
            target: joint targets that have been sent since t = −∞ [rad].
            q: joint angles [rad].

        Source:
            Ours: an episode starts without a transient of the command path.
        """
        ...

    def act(
        self,
        drive: Any,
        fields: ModelFields,
        state: PhysicsState,
        target: Float[Array, " joints"],
    ) -> tuple[Any, ModelFields, Float[Array, "substeps joints"]]:
        """Prepares a round: (x, target, q, q̇) ↦ (x', changed fields, controls).

        Args:
            drive: state of the drive, x.
            fields: model fields of this world; gains and limits of its drives among
                them, in the units of `MjModel` [N·m/rad, N·m·s/rad, N·m].
            state: state of the physics before the round.
            target: joint targets, held over the control step [rad].

        Returns:
            The new state, the model fields that differ from `fields` in this round, and
            the controls of its substeps [rad].

        Source:
            Paper, command path and actuators; `envs.actuator` for the effects.
        """
        ...

    def observe(self, drive: Any, output: PhysicsOutput) -> Any:
        """Takes in what the physics made of a round."""
        ...

    def reading(
        self, drive: Any, q: Float[Array, " joints"]
    ) -> Float[Array, " joints"]:
        """Joint angles that the encoders report to the host: y = h(x, q) [rad].

        Args:
            drive: state of the drive, x.
            q: joint angles of the physics [rad].

        Source:
            Ours: see `Stage.READING` and `Stage.ENCODER` of the actuator chain.
        """
        ...


def make_drive(hand: HandFile, model: mujoco.MjModel, n_substeps: int) -> Drive:
    """Makes the drive of a hand: the chain if it has effects of joints, else servos.

    Args:
        hand: the hand file.
        model: the scene with this hand.
        n_substeps: physics steps of a control step.

    Raises:
        InputError: the delay of the hand is longer than the drive can hold.
    """
    chain = chain_drive(hand, model, n_substeps, PHYSICS_DT_S)
    return chain or servo_drive(hand, n_substeps, PHYSICS_DT_S)
