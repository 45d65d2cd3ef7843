"""What an evaluation keeps of every control step, and the measures it turns into."""

import flax.struct
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from envs.base import State
from envs.physics.room import ROOM
from fingers_mjx.evaluation import measures, tracking_error

MASS_KG = 0.818


@flax.struct.dataclass
class Trace:
    """The part of the signals that measures and plots read.

    Leading axes: none for one step of one hand, T for one episode, T and episodes for a
    whole evaluation.

    Attributes:
        command: v_x, v_y [m/s] and yaw rate [rad/s], in V.
        vel_v: planar velocity of the palm in V [m/s].
        yaw_rate: of the palm about V's z axis [rad/s].
        palm_pos_w: origin of the palm [m].
        palm_quat_w: orientation of the palm, w x y z.
        joint_pos: joint angles [rad].
        tip_pos_v: fingertips relative to the palm in V [m].
        tip_force_n: ground contact force per tip [N].
        pad_tilt_rad: elevation of the pad normals, towards the nail [rad].
        undesired: the palm or a link that is no fingertip touches the ground.
        power_w: Σ |torque · joint speed| [W].
        done: the episode ended in this step.
        failed: it ended for another reason than the time limit.
        overflow: contacts or constraints were dropped, in the order of
            `envs.physics.room.ROOM`.
        extra: the task's own signals by name.
    """

    command: Float[Array, "*t 3"]
    vel_v: Float[Array, "*t 2"]
    yaw_rate: Float[Array, "*t"]
    palm_pos_w: Float[Array, "*t 3"]
    palm_quat_w: Float[Array, "*t 4"]
    joint_pos: Float[Array, "*t joints"]
    tip_pos_v: Float[Array, "*t tips 3"]
    tip_force_n: Float[Array, "*t tips"]
    pad_tilt_rad: Float[Array, "*t tips"]
    undesired: Bool[Array, "*t"]
    power_w: Float[Array, "*t"]
    done: Bool[Array, "*t"]
    failed: Bool[Array, "*t"]
    overflow: Bool[Array, "*t 2"]
    extra: dict[str, Array] = flax.struct.field(default_factory=dict)


def record(state: State) -> Trace:
    """Returns the step's part of the trace; leading axes of `state` are kept."""
    signals, done = state.signals, state.done > 0
    links = signals.link_contact.any(axis=-1)
    power = jnp.abs(signals.torque_nm * signals.joint_vel).sum(axis=-1)
    dropped = [state.metrics.get(name, jnp.zeros_like(power)) > 0 for name in ROOM]
    return Trace(
        command=signals.command,
        vel_v=signals.vel_v[..., :2],
        yaw_rate=signals.angvel_v[..., 2],
        palm_pos_w=signals.palm_pos_w,
        palm_quat_w=signals.palm_quat_w,
        joint_pos=signals.joint_pos,
        tip_pos_v=signals.tip_pos_v,
        tip_force_n=signals.tip_force_n,
        pad_tilt_rad=signals.pad_tilt_rad,
        undesired=links | (signals.palm_contact > 0),
        power_w=power,
        done=done,
        failed=done & (state.info["truncation"] == 0),
        overflow=jnp.stack(dropped, axis=-1),
        extra=signals.extra,
    )


def episode_measures(
    trace: Trace, dt_s: float, mass_kg: float = MASS_KG
) -> dict[str, Float[Array, ""]]:
    """Returns every measure y = f(x_{t=1..T}) of one episode; NaN where undefined.

    Units stand at the end of the names: duration [s], energy [J], speed [m/s], turn
    rate [rad/s], tilt [°]; fractions and counts have none [1]. An episode lasts until
    its first `done` and no step after it counts; for that step itself see
    `measures.steps_alive`.

    Args:
        trace: one episode, time first.
        dt_s: control interval.
        mass_kg: of the hand and what it carries.

    Source:
        `fingers_mjx.evaluation.measures`, each with its own.
    """
    alive = measures.steps_alive(trace.done, trace.failed)
    to_the_end = measures.steps_alive(trace.done, jnp.zeros_like(trace.failed))
    return {
        "task_speed_mps": measures.task_speed_mps(trace.vel_v, trace.command, alive),
        **_contact_measures(trace, alive),
        "survival": measures.survival(trace.failed & to_the_end),
        **_motion_measures(trace, alive, dt_s, mass_kg),
    }


def _contact_measures(trace: Trace, alive: Array) -> dict[str, Array]:
    force, tilt = trace.tip_force_n, trace.pad_tilt_rad
    per_tip = jnp.rad2deg(measures.contact_tilt_rad(force, tilt, alive))
    return {
        "five_finger_participation": measures.five_finger_participation(force, alive),
        "non_nail_participation": measures.non_nail_participation(force, tilt, alive),
        "mean_contact_tilt_deg": jnp.nanmean(per_tip),
        "worst_tip_contact_tilt_deg": jnp.nanmax(per_tip),
        "worst_tip_planting_fraction": measures.worst_tip_planting_fraction(
            force, tilt, alive
        ),
        "undesired_contact_rate": measures.undesired_contact_rate(
            trace.undesired, alive
        ),
    }


def _motion_measures(
    trace: Trace, alive: Array, dt_s: float, mass_kg: float
) -> dict[str, Array]:
    command = trace.command
    duration = alive.sum() * dt_s
    energy = measures.energy_j(trace.power_w, alive, dt_s)
    speed = measures.path_speed_mps(trace.palm_pos_w, alive, dt_s)
    planar = jnp.linalg.norm(command[:, :2], axis=1)
    return {
        "duration_s": duration,
        "energy_j": energy,
        "path_speed_mps": speed,
        "cost_of_transport": measures.cost_of_transport(
            energy, speed, duration, mass_kg
        ),
        "turn_rate_rad_s": measures.masked_mean(trace.yaw_rate, alive),
        "turn_rate_error_rad_s": tracking_error.turn_rate_error_rad_s(
            trace.yaw_rate, command[:, 2], alive, dt_s
        ),
        "planar_velocity_error_mps": tracking_error.planar_velocity_error_mps(
            trace.vel_v, command, alive, dt_s
        ),
        "command_speed_mps": measures.masked_mean(planar, alive),
        "command_turn_rate_rad_s": measures.masked_mean(command[:, 2], alive),
        "contact_overflow_rate": measures.masked_mean(
            trace.overflow.any(axis=-1) * 1.0, alive
        ),
    }
