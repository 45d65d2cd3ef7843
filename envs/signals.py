"""Signals: everything that rewards, observations, terminations and measures may read.

Frames: `_w` world, `_b` palm body, `_v` the stance-calibrated control frame V, which
turns with the palm and is level in the nominal stance (x forward, z up).
"""

import flax.struct
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Shaped

from envs.hand.model import PALM, PAYLOAD, V_SITE
from envs.hand.spec import HandSpec
from envs.physics.base import PhysicsOutput, PhysicsState
from envs.rotations import multiply, rotate, unrotate
from rewards import safe_norm


@flax.struct.dataclass
class Signals:
    """One hand after one control step.

    Attributes:
        joint_pos: joint angles [rad].
        joint_vel: joint speeds [rad/s].
        joint_acc: change of joint speed over the control step [rad/s²].
        torque_nm: joint torques of the drive [N·m].
        palm_pos_w: origin of the palm body [m].
        palm_quat_w: orientation of the palm body, w x y z.
        gravity_b: unit vector of gravity (points down) in the palm frame.
        angvel_b: angular velocity of the palm in the palm frame [rad/s].
        vel_v: linear velocity of the palm in V [m/s].
        angvel_v: angular velocity of the palm in V [rad/s].
        tip_pos_v: fingertip centres relative to the palm origin in V [m].
        tip_vel_v: fingertip velocities relative to the rotating base in V [m/s].
        tip_vel_w: fingertip velocities in the world [m/s].
        tip_force_n: magnitude of the ground contact force on each fingertip [N].
        tip_shear_n: magnitude of its part along the ground [N].
        pad_tilt_rad: elevation of each pad normal above the horizontal; +π/2 stands on
            the nail.
        link_contact: 1 for each non-fingertip finger link that touches the ground.
        palm_contact: 1 if the palm or its payload touches the ground.
        tilt_rad: roll and pitch of V against level [rad].
        command: v_x, v_y [m/s] and yaw rate [rad/s], in V.
        action: clipped policy output of this step.
        previous_action: clipped policy output of the step before.
        extra: the task's own signals by name, see `envs.task.HandTask`.
    """

    joint_pos: Float[Array, "*b joints"]
    joint_vel: Float[Array, "*b joints"]
    joint_acc: Float[Array, "*b joints"]
    torque_nm: Float[Array, "*b joints"]
    palm_pos_w: Float[Array, "*b 3"]
    palm_quat_w: Float[Array, "*b 4"]
    gravity_b: Float[Array, "*b 3"]
    angvel_b: Float[Array, "*b 3"]
    vel_v: Float[Array, "*b 3"]
    angvel_v: Float[Array, "*b 3"]
    tip_pos_v: Float[Array, "*b tips 3"]
    tip_vel_v: Float[Array, "*b tips 3"]
    tip_vel_w: Float[Array, "*b tips 3"]
    tip_force_n: Float[Array, "*b tips"]
    tip_shear_n: Float[Array, "*b tips"]
    pad_tilt_rad: Float[Array, "*b tips"]
    link_contact: Float[Array, "*b links"]
    palm_contact: Float[Array, "*b"]
    tilt_rad: Float[Array, "*b 2"]
    command: Float[Array, "*b 3"]
    action: Float[Array, "*b joints"]
    previous_action: Float[Array, "*b joints"]
    extra: dict[str, Shaped[Array, "..."]] = flax.struct.field(default_factory=dict)


@flax.struct.dataclass
class Command:
    """What the policy was asked and what it did, as the signals repeat it.

    Attributes:
        command: v_x, v_y [m/s] and yaw rate [rad/s], in V.
        action: clipped policy output of this step.
        previous_action: clipped policy output of the step before.
    """

    command: Float[Array, "*b 3"]
    action: Float[Array, "*b joints"]
    previous_action: Float[Array, "*b joints"]


def extract_signals(
    spec: HandSpec,
    q_off: Float[Array, "4"],
    before: PhysicsState,
    output: PhysicsOutput,
    asked: Command,
    dt_s: float,
) -> Signals:
    """Reads all signals of one hand after a control step, s = h(x_t, x_{t+1}, y_{t+1}).

    With orientation Q of the palm: ω_V = q_off* ⊗ ω_b ⊗ q_off, v_V = V* ⊗ v_w ⊗ V with
    V = Q ⊗ q_off, q̈ ≈ (q̇_{t+1} − q̇_t)/Δt.

    Joints and base come from the state; fingertips, torques and contacts from the
    sensors, which every backend leaves one physics step (5 ms) behind. Tip quantities
    are taken relative to the base at the sensors' time.

    Args:
        spec: indices of the model.
        q_off: rotation from the palm to V, w x y z.
        before: physics state before the control step.
        output: result of the control step.
        asked: command and actions.
        dt_s: control interval Δt [s].

    Returns:
        Quantities in SI units ([m], [rad], [N·m]), see `Signals`.

    Source:
        Paper, frames; the finite difference and the sensors' delay are ours.
    """
    state, sensors = output.state, output.sensordata
    quat_w, angvel_b = state.qpos[3:7], state.qvel[3:6]
    v_quat_w, joint_vel = multiply(quat_w, q_off), state.qvel[spec.joint_qvel]
    return Signals(
        joint_pos=state.qpos[spec.joint_qpos],
        joint_vel=joint_vel,
        joint_acc=(joint_vel - before.qvel[spec.joint_qvel]) / dt_s,
        torque_nm=_stack(spec, sensors, "torque", spec.joints)[:, 0],
        palm_pos_w=state.qpos[:3],
        palm_quat_w=quat_w,
        gravity_b=gravity(quat_w),
        angvel_b=angvel_b,
        vel_v=unrotate(v_quat_w, state.qvel[:3]),
        angvel_v=unrotate(q_off, angvel_b),
        **_tip_signals(spec, sensors),
        **_tip_forces(spec, sensors),
        link_contact=_touching(spec, sensors, spec.other_links),
        palm_contact=jnp.max(_touching(spec, sensors, (PALM, PAYLOAD))),
        tilt_rad=tilt(v_quat_w),
        **vars(asked),
    )


def gravity(quat_w: Float[Array, "4"]) -> Float[Array, "3"]:
    """Unit vector of gravity in a frame of the given orientation.

    g = q* ⊗ (0, 0, −1) ⊗ q.

    Args:
        quat_w: orientation q of the frame, w x y z.

    Returns:
        Direction [1], pointing down.

    Source:
        Paper, policy interfaces (projected gravity).
    """
    return unrotate(quat_w, jnp.array([0.0, 0.0, -1.0]))


def tilt(v_quat_w: Float[Array, "4"]) -> Float[Array, "2"]:
    """Roll and pitch of V against level [rad], in (−π, π] and [−π/2, π/2].

    With the world's up direction u in V: roll = atan2(u_y, u_z), pitch = asin(−u_x).

    Source:
        The z-y-x Euler angles, as in Siciliano et al., "Robotics: Modelling, Planning
        and Control" (2009), ch. 2.
    """
    up = -gravity(v_quat_w)
    return jnp.stack([jnp.arctan2(up[1], up[2]), _arcsin(-up[0])])


def tilt_from_level(gravity_v: Float[Array, "3"]) -> Float[Array, ""]:
    """Angle between V's upward axis and up, θ = atan2(√(g_x² + g_y²), −g_z).

    Args:
        gravity_v: unit vector g of gravity in V [1].

    Returns:
        θ [rad] in [0, π]; its gradient is finite where V is level.

    Source:
        Paper, fall recovery (stance-relative tilt).
    """
    return jnp.arctan2(safe_norm(gravity_v[:2]), -gravity_v[2])


def _tip_signals(
    spec: HandSpec, sensors: Float[Array, " n"]
) -> dict[str, Float[Array, "..."]]:
    """Positions, velocities and pad tilts of the tips."""
    base_pos, base_quat, base_vel, base_angvel = (
        spec.read(sensors, f"{kind}_{V_SITE}")
        for kind in ("pos", "quat", "linvel", "angvel")
    )
    pos_w = _stack(spec, sensors, "pos", spec.tip_sites)
    vel_w = _stack(spec, sensors, "linvel", spec.tip_sites)
    offset_w = pos_w - base_pos
    relative_w = vel_w - base_vel - jnp.cross(base_angvel, offset_w)
    to_v = jax.vmap(lambda x: unrotate(base_quat, x))
    pad_w = jax.vmap(lambda quat: rotate(quat, jnp.array([1.0, 0.0, 0.0])))(
        _stack(spec, sensors, "quat", spec.tip_sites)
    )
    return {
        "tip_pos_v": to_v(offset_w),
        "tip_vel_v": to_v(relative_w),
        "tip_vel_w": vel_w,
        "pad_tilt_rad": _arcsin(pad_w[:, 2]),
    }


def _tip_forces(
    spec: HandSpec, sensors: Float[Array, " n"]
) -> dict[str, Float[Array, " tips"]]:
    """Magnitude of the floor's force on each tip, and of its part along the floor [N].

    The sensors give the force in the contact's frame, whose first axis is the normal.
    """
    squares = _stack(spec, sensors, "force", spec.tip_spheres) ** 2
    along = jnp.sum(squares[:, 1:], axis=-1)
    return {
        "tip_force_n": jnp.sqrt(jnp.sum(squares, axis=-1)),
        "tip_shear_n": jnp.sqrt(along),
    }


def _touching(
    spec: HandSpec, sensors: Float[Array, " n"], geoms: tuple[str, ...]
) -> Float[Array, " m"]:
    """1 for each geom that touches the floor."""
    found = _stack(spec, sensors, "found", geoms)[:, 0]
    return (found > 0).astype(sensors.dtype)


def _stack(
    spec: HandSpec, sensors: Float[Array, " n"], kind: str, names: tuple[str, ...]
) -> Float[Array, "names m"]:
    return jnp.stack([spec.read(sensors, f"{kind}_{name}") for name in names])


def _arcsin(x: Float[Array, "*b"]) -> Float[Array, "*b"]:
    """Arc sine of a component of a unit vector, which rounding may put beyond 1."""
    return jnp.arcsin(jnp.clip(x, -1.0, 1.0))
