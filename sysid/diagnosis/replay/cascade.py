"""What a cascade of loops (P-PI) has beside the two gains of a servo.

    v_ref = clip(k_pos (c − y), ± v_max),   u = k_vel (v_ref − ẏ)
    τ = limited(u + z),   ż = r (τ − z),   r = k_int / k_vel

Within the limits of the torque τ − z = u, so z = k_int ∫ (v_ref − ẏ) dt. At a limit z
stays where it is while u pushes further, and otherwise ż = r u: it does not wind up.
Along a measured motion τ is the torque that was measured: z follows that with the time
constant 1 / r, and no error of a reading adds up.

With kp = k_pos k_vel and kd = k_vel the first line limits the error c − y to
± v_max kd / kp, and u is the law of a servo with two gains.
"""

from collections.abc import Mapping
from dataclasses import replace

import flax.struct
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from envs.actuator.effect import EffectKind, Params, Stage, Substep
from sysid.drive import JointDrive

NAME = "cascade"
BEFORE = "torque_limit"
"""Effect before which it acts: behind what changes the error, in front of limits."""


@flax.struct.dataclass
class Integral:
    """State of the velocity loop; torques in N·m.

    Attributes:
        value: z.
        moved_by: τ − z of the substep before; what z moved by where it was limited.
        servo: u of this substep.
        kp: position gain of this substep [N·m/rad].
        anew: 1 where z is not known, but the torque τ = u + z, which `value` is then.
    """

    value: Float[Array, "*j"]
    moved_by: Float[Array, "*j"]
    servo: Float[Array, "*j"]
    kp: Float[Array, "*j"]
    anew: Float[Array, "*j"]


def follow(
    state: Integral, torque: Float[Array, "*j"], rate: Float[Array, "*#j"], dt: float
) -> Integral:
    """Advances the integral by ż = r (τ − z), by the trapezoidal rule.

        z' = (z + h (w + τ')) / (1 + h),   w' = τ' − z',   h = r Δt / 2

    Args:
        state: z and w = τ − z of the substep before [N·m].
        torque: τ' of this substep [N·m].
        rate: r = k_int / k_vel ≥ 0 [1/s]; at 0 the integral stays as it is.
        dt: Δt [s]; errors are of the second order in r Δt.

    Returns:
        The state with z' and w' [N·m].

    Source:
        PI control by a lag of its own output: K. J. Åström, T. Hägglund, Advanced PID
        Control, ISA 2006, section 3.5.
    """
    half = 0.5 * rate * dt
    value = (state.value + half * (state.moved_by + torque)) / (1.0 + half)
    return replace(state, value=value, moved_by=torque - value)


def rate_of(params: Params, x: Substep) -> Float[Array, "*j"]:
    """Rate of the integral: r = k_int / k_vel with k_vel = kd [1/s]."""
    return params["k_int"] / x.kd


def _most(params: Params, x: Substep) -> Float[Array, "*j"]:
    """The largest error that still raises v_ref: v_max / k_pos [rad]."""
    return params["speed_limit"] * x.kd / x.kp


def _clip_speed(params: Params, state: Integral, x, dt):
    most = _most(params, x)
    return state, x.replace(error=jnp.clip(x.error, -most, most))


def _raised(params: Params, state: Integral, x, dt):
    """Returns z if it moves by u: z' = z + r Δt (w + u) / 2."""
    return state.value + 0.5 * rate_of(params, x) * dt * (state.moved_by + state.servo)


def answered(state: Integral, servo: Float[Array, "*j"]) -> Integral:
    """Begins at z = τ − u where only τ was known; w = −u holds it for a substep.

    Args:
        state: of the substep before.
        servo: u of this substep [N·m].

    Returns:
        The state, with z everywhere.

    Source:
        Ours.
    """
    first = state.anew > 0.0
    return replace(
        state,
        value=jnp.where(first, state.value - servo, state.value),
        moved_by=jnp.where(first, -servo, state.moved_by),
        servo=servo,
        anew=jnp.zeros_like(servo),
    )


def _add(params: Params, state: Integral, x, dt):
    """Adds the integral; what acts on torques sees no kp at the limit of the speed."""
    state = replace(answered(state, x.torque), kp=x.kp)
    follows = jnp.where(jnp.abs(x.error) >= _most(params, x), 0.0, x.kp)
    torque = x.torque + _raised(params, state, x, dt)
    return state, x.replace(torque=torque, kp=follows)


def _advance(params: Params, state: Integral, x, dt):
    """Moves on by the torque of the drive; a limited drive does not wind up."""
    free = follow(state, x.effort, rate_of(params, x), dt)
    none = jnp.zeros_like(x.effort)
    back = state.servo * x.effort < 0.0
    value = jnp.where(back, _raised(params, state, x, dt), state.value)
    moved_by = jnp.where(back, state.servo, none)
    limited = replace(state, value=value, moved_by=moved_by)
    at_limit = x.follows <= 0.0
    state = jax.tree.map(lambda a, b: jnp.where(at_limit, a, b), limited, free)
    return state, x.replace(kp=state.kp)


def _rest(params: Params, target, q, dt) -> Integral:
    """Begins at the torque of the drive; without an integral at none."""
    none = jnp.zeros_like(q)
    known = jnp.broadcast_to(params["k_int"] > 0.0, q.shape)
    held = jnp.where(known, params["start_nm"], none)
    return Integral(held, none, none, none, known.astype(none.dtype))


def begun(
    state: Integral, anew: Bool[Array, "*#j"], torque: Float[Array, "*j"]
) -> Integral:
    """Begins anew where a simulation does: z = τ − u.

    Args:
        state: of the simulation so far.
        anew: where it begins anew; never without an integral.
        torque: τ of the drive there [N·m].

    Returns:
        The state, whose z is known after the next substep.

    Source:
        Ours.
    """
    return replace(
        state,
        value=jnp.where(anew, torque, state.value),
        anew=jnp.where(anew, 1.0, state.anew),
    )


KIND = EffectKind(
    name=NAME,
    equation="ż = r (τ − z), |v_ref| ≤ v_max",
    parameters={},
    acts={
        Stage.ERROR: _clip_speed,
        Stage.TORQUE: _add,
        Stage.TRANSMISSION: _advance,
    },
    confusable_with={},
    source="K. J. Åström, T. Hägglund, Advanced PID Control, ISA 2006",
    init=_rest,
)
"""It acts beside the effects of a catalogue, and is none: no search adds it."""


def with_cascade(
    effects: Mapping[str, Params],
    cascade: Mapping[str, Float[Array, " p"]],
    factor: Float[Array, "1 c"],
) -> dict[str, Params]:
    """Puts a cascade between effects, with k_int μ for factors μ of candidates c [1].

    Args:
        effects: parameters by name, in the order of the chain.
        cascade: parameters of the pieces p, see `motion.Track`; none without a cascade.
        factor: μ.

    Returns:
        The effects in their order, `cascade` in front of `BEFORE`.

    Source:
        Ours.
    """
    if not cascade:
        return dict(effects)
    wide = {name: value[:, None] for name, value in cascade.items()}
    own = {NAME: {**wide, "k_int": wide["k_int"] * factor}}
    names = list(effects)
    first = {n: effects[n] for n in names[: names.index(BEFORE)]}
    return {**first, **own, **effects}


def cascade_of(
    drive: JointDrive, fields: Mapping[str, np.ndarray], logged: Bool[np.ndarray, " p"]
) -> dict[str, Float[Array, " p"]]:
    """Parameters of the pieces p, with the torque that a joint begins with.

        τ_0 = τ_log,   or  −τ_load where the effort is not logged

    Args:
        drive: of the joint.
        fields: of its track, see `motion.Track`.
        logged: whether the effort of a piece was logged.

    Returns:
        k_int [N·m/rad], speed limit [rad/s] and τ_0 [N·m]; nothing without a cascade,
        or where the law of the drive is not known.

    Source:
        Ours: a record begins at rest, if no effort says more.
    """
    if drive.cascade is None or drive.known == "mechanics":
        return {}
    load = fields["push"][0] + fields["ext"][0]
    load = load + np.sum(fields["moment"][0] * fields["gravity"], -1)
    each = np.ones(len(logged))
    found = {
        "k_int": drive.cascade.k_int.value * each,
        "speed_limit": drive.cascade.speed_limit * each,
        "start_nm": np.where(logged, fields["effort"][0], -load),
    }
    return {name: jnp.asarray(x, jnp.float32) for name, x in found.items()}
