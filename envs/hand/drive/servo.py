"""The actuator chain of a hand without effects of joints.

Every physics substep: target → transport delay → firmware low-pass → speed limit →
position servo with torque limit. The stages are in series, each with a state of its
own: the firmware filter does not know that the motor saturates behind it. The speed
limit comes after the filter because the paper measures the speed of the *filtered*
response (2.8 and 2.5 rad/s ramps), which bounds what the servo follows. The formulas
are those of the effects of these names; `envs.hand.drive.chain` runs all effects.
"""

import math

import flax.struct
import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from envs.actuator.effects.lowpass_cutoff import filtered
from envs.actuator.effects.slew_limit import limited
from envs.actuator.effects.transport_delay import read_delayed
from envs.errors import InputError
from envs.hand.hand_file import HandFile

MAX_DELAY_S = 0.04
_MAX_UNROLL = 8


@flax.struct.dataclass
class DriveParams:
    """Parameters of the chain; all but the length of the delay line may be traced.

    Attributes:
        delay_s: transport delay of the target [s], in [0, max_delay_s].
        lowpass_hz: cutoff of the first-order low-pass [Hz], > 0; infinite: no filter.
        speed_limit: largest speed of the command [rad/s]; infinite: no limit.
        kp: position gain [N·m/rad].
        kd: velocity gain [N·m·s/rad].
        torque_limit: largest torque [N·m].
        max_delay_s: the longest delay that the delay line can hold [s] (static).
    """

    delay_s: Float[Array, "*b"]
    lowpass_hz: Float[Array, "*b"]
    speed_limit: Float[Array, "*b 20"]
    kp: Float[Array, "*b 20"]
    kd: Float[Array, "*b 20"]
    torque_limit: Float[Array, "*b 20"]
    max_delay_s: float = flax.struct.field(pytree_node=False, default=MAX_DELAY_S)


@flax.struct.dataclass
class DriveState:
    """What the chain carries from substep to substep [rad].

    Attributes:
        targets: the last targets, newest first, one per substep.
        filtered: output of the low-pass.
        command: output of the speed limit, which the servo follows.
    """

    targets: Float[Array, "*b slots 20"]
    filtered: Float[Array, "*b 20"]
    command: Float[Array, "*b 20"]


def drive_params(
    hand: HandFile,
    kp: Float[ArrayLike, "20"],
    kv: Float[ArrayLike, "20"],
    force_limit: Float[ArrayLike, "20"],
    max_delay_s: float = MAX_DELAY_S,
) -> DriveParams:
    """Applies the scales of a hand file to the vendor's nominal drive figures.

    Args:
        hand: the hand file.
        kp: nominal position gains [N·m/rad].
        kv: nominal velocity gains [N·m·s/rad].
        force_limit: nominal torque limits [N·m].
        max_delay_s: longest delay the drive must be able to hold, e.g. the upper end of
            a randomization [s].

    Raises:
        InputError: the delay of the hand is longer than `max_delay_s`.
    """
    if hand.delay_s.value > max_delay_s:
        found, valid = hand.delay_s.value, f"at most max_delay_s = {max_delay_s:g} s"
        raise InputError("hand file", "delay_s.value", found, valid)
    return DriveParams(
        delay_s=jnp.asarray(hand.delay_s.value),
        lowpass_hz=jnp.asarray(hand.lowpass_hz.value),
        speed_limit=jnp.asarray(hand.speed_limit.per_joint()),
        kp=jnp.asarray(kp) * hand.stiffness_scale.per_joint(),
        kd=jnp.asarray(kv) * hand.damping_scale.per_joint(),
        torque_limit=jnp.asarray(force_limit) * hand.torque_scale.per_joint(),
        max_delay_s=max_delay_s,
    )


def init_drive_state(
    target: Float[Array, "20"], params: DriveParams, dt: float
) -> DriveState:
    """Returns the chain at rest: `target` [rad] has been sent for ever.

    The delay line has ceil(max_delay_s / dt) + 1 slots; `dt` is the substep [s].
    """
    slots = math.ceil(round(params.max_delay_s / dt, 6)) + 1
    targets = jnp.broadcast_to(target, (slots, *target.shape))
    return DriveState(targets=targets, filtered=target, command=target)


def command_step(
    params: DriveParams, state: DriveState, target: Float[Array, "20"], dt: float
) -> tuple[DriveState, Float[Array, "20"]]:
    """Advances the command path by one substep.

    The formulas are those of the effects `transport_delay`, `lowpass_cutoff` and
    `slew_limit`:

        x_k = u(t_k − T),   ẏ = 2π f_c (x − y),   |ċ| ≤ v_max

    Args:
        params: parameters of the drive.
        state: state after the previous substep.
        target: joint targets of this substep [rad]; with no delay they act at once.
        dt: substep [s].

    Returns:
        The new state and the command c_k that the servo follows [rad].
    """
    targets = jnp.concatenate([target[None], state.targets[:-1]])
    delayed = read_delayed(targets, params.delay_s, dt)
    smooth = filtered(state.filtered, delayed, params.lowpass_hz, dt)
    command = limited(state.command, smooth, params.speed_limit, dt)
    return DriveState(targets=targets, filtered=smooth, command=command), command


def servo_torque(
    params: DriveParams,
    command: Float[Array, "20"],
    q: Float[Array, "20"],
    qd: Float[Array, "20"],
) -> Float[Array, "20"]:
    """Position servo: τ = clip(kp (c − q) − kd q̇, ±τ_max) [N·m].

    MuJoCo computes the same in an actuator with gainprm kp, biasprm (0, −kp, −kd) and
    forcerange ±τ_max, where an implicit integrator sees the damping.

    Args:
        params: parameters of the drive.
        command: output of `command_step` [rad].
        q: joint angles [rad].
        qd: joint speeds [rad/s].
    """
    torque = params.kp * (command - q) - params.kd * qd
    return jnp.clip(torque, -params.torque_limit, params.torque_limit)


def drive_step(
    params: DriveParams,
    state: DriveState,
    target: Float[Array, "20"],
    q: Float[Array, "20"],
    qd: Float[Array, "20"],
    dt: float,
) -> tuple[DriveState, Float[Array, "20"], Float[Array, "20"]]:
    """The whole chain for one substep: `command_step`, then `servo_torque`.

    Returns:
        The new state, the command [rad] and the joint torque [N·m].
    """
    state, command = command_step(params, state, target, dt)
    return state, command, servo_torque(params, command, q, qd)


def command_sequence(
    params: DriveParams,
    state: DriveState,
    target: Float[Array, "20"],
    dt: float,
    n_substeps: int,
) -> tuple[DriveState, Float[Array, "n 20"]]:
    """Commands of the substeps of one control step, for servos inside the physics.

    Args:
        params: parameters of the drive.
        state: state after the previous control step.
        target: joint targets, held over the control step [rad].
        dt: substep [s].
        n_substeps: number of substeps.

    Returns:
        The new state and the `n_substeps` commands in order [rad].
    """
    return jax.lax.scan(
        lambda carry, _: command_step(params, carry, target, dt),
        state,
        length=n_substeps,
        unroll=min(n_substeps, _MAX_UNROLL),
    )
