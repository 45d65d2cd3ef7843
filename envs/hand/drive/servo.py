"""The drive of a hand without effects of joints: a command path and MuJoCo's servos.

Every physics substep: target → transport delay → firmware low-pass → speed limit →
position servo with torque limit. The stages are in series, each with a state of its
own: the firmware filter does not know that the motor saturates behind it. The speed
limit comes after the filter because the paper measures the speed of the *filtered*
response (2.8 and 2.5 rad/s ramps), which bounds what the servo follows. The formulas
are those of the effects of these names; `envs.hand.drive.chain` runs all effects. The
servo is an actuator of the model, see `envs.hand.model`.
"""

import math
from dataclasses import dataclass

import flax.struct
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from envs.actuator.effects.lowpass_cutoff import filtered
from envs.actuator.effects.slew_limit import limited
from envs.actuator.effects.transport_delay import read_delayed
from envs.errors import InputError
from envs.hand.hand_file import HandFile
from envs.physics.base import ModelFields, PhysicsOutput, PhysicsState

MAX_DELAY_S = 0.04
"""The longest delay that the delay line can hold [s]."""
_MAX_UNROLL = 8


@flax.struct.dataclass
class CommandPath:
    """Parameters of the command path; they may be traced.

    Attributes:
        delay_s: transport delay of the target [s], in [0, MAX_DELAY_S].
        lowpass_hz: cutoff of the first-order low-pass [Hz], > 0; infinite: no filter.
        speed_limit: largest speed of the command [rad/s]; infinite: no limit.
    """

    delay_s: Float[Array, "*b"]
    lowpass_hz: Float[Array, "*b"]
    speed_limit: Float[Array, "*b joints"]


@flax.struct.dataclass
class CommandState:
    """What the command path carries from substep to substep [rad].

    Attributes:
        targets: the last targets, newest first, one per substep.
        filtered: output of the low-pass.
        command: output of the speed limit, which the servo follows.
    """

    targets: Float[Array, "*b slots joints"]
    filtered: Float[Array, "*b joints"]
    command: Float[Array, "*b joints"]


@dataclass(frozen=True)
class ServoDrive:
    """`envs.hand.drive.drive.Drive` of servos inside the physics.

    Attributes:
        path: parameters of the command path.
        n_substeps: physics steps of a control step.
        dt: substep [s].
    """

    path: CommandPath
    n_substeps: int
    dt: float

    @property
    def rounds(self) -> int:
        """One: nothing depends on the physics."""
        return 1

    def begin(
        self, target: Float[Array, " joints"], q: Float[Array, " joints"] | None = None
    ) -> CommandState:
        """The command path at rest: x_k = y = c = target for all k [rad].

        The delay line has ceil(MAX_DELAY_S / dt) + 1 slots.

        Source:
            Ours: an episode starts without a transient of the command path.
        """
        slots = math.ceil(round(MAX_DELAY_S / self.dt, 6)) + 1
        targets = jnp.broadcast_to(target, (slots, *target.shape))
        return CommandState(targets=targets, filtered=target, command=target)

    def commands(
        self, drive: CommandState, target: Float[Array, " joints"]
    ) -> tuple[CommandState, Float[Array, "substeps joints"]]:
        """Commands of one control step: c_k = `command_step` of c_{k−1}, k ≤ n [rad].

        Args:
            drive: state after the previous control step.
            target: joint targets, held over the control step [rad].

        Source:
            Ours: the physics takes the controls of all its substeps in one call.
        """
        return jax.lax.scan(
            lambda state, _: command_step(self.path, state, target, self.dt),
            drive,
            length=self.n_substeps,
            unroll=min(self.n_substeps, _MAX_UNROLL),
        )

    def act(
        self,
        drive: CommandState,
        fields: ModelFields,
        state: PhysicsState,
        target: Float[Array, " joints"],
    ) -> tuple[CommandState, ModelFields, Float[Array, "substeps joints"]]:
        """Commands of one control step: (x, target) ↦ (x', {}, c₁ … c_n) [rad].

        Source:
            See `commands`; the gains of the servos are in the fields already.
        """
        drive, commands = self.commands(drive, target)
        return drive, {}, commands

    def observe(self, drive: CommandState, output: PhysicsOutput) -> CommandState:
        """Unchanged: nothing depends on the physics."""
        return drive

    def reading(
        self, drive: CommandState, q: Float[Array, " joints"]
    ) -> Float[Array, " joints"]:
        """Exact encoders without delay: y = q [rad].

        Source:
            Paper, policy interfaces; errors of encoders are effects.
        """
        return q


def servo_drive(hand: HandFile, n_substeps: int, dt: float) -> ServoDrive:
    """Makes the drive of a hand without effects of joints.

    Args:
        hand: the hand file.
        n_substeps: physics steps of a control step.
        dt: substep [s].

    Raises:
        InputError: the delay of the hand is longer than `MAX_DELAY_S`.
    """
    if hand.delay_s.value > MAX_DELAY_S:
        found, valid = hand.delay_s.value, f"at most {MAX_DELAY_S:g} s"
        raise InputError("hand file", "delay_s.value", found, valid)
    numbers = (hand.delay_s.value, hand.lowpass_hz.value, hand.per_joint("speed_limit"))
    path = CommandPath(*(jnp.asarray(x, jnp.float32) for x in numbers))
    return ServoDrive(path, n_substeps, dt)


def command_step(
    path: CommandPath, state: CommandState, target: Float[Array, " joints"], dt: float
) -> tuple[CommandState, Float[Array, " joints"]]:
    """Advances the command path by one substep.

    The formulas are those of the effects `transport_delay`, `lowpass_cutoff` and
    `slew_limit`:

        x_k = u(t_k − T),   ẏ = 2π f_c (x − y),   |ċ| ≤ v_max

    Args:
        path: T [s], f_c [Hz] and v_max [rad/s].
        state: state after the previous substep.
        target: joint targets u of this substep [rad]; with no delay they act at once.
        dt: substep [s].

    Returns:
        The new state and the command c_k that the servo follows [rad].

    Source:
        Paper, command path.
    """
    targets = jnp.concatenate([target[None], state.targets[:-1]])
    delayed = read_delayed(targets, path.delay_s, dt)
    smooth = filtered(state.filtered, delayed, path.lowpass_hz, dt)
    command = limited(state.command, smooth, path.speed_limit, dt)
    return CommandState(targets=targets, filtered=smooth, command=command), command
