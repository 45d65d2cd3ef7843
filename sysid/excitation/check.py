"""Runs a plan on the model, with collisions, and makes it smaller until it fits."""

import copy
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from envs.actuator.catalogue import effect_kind
from envs.actuator.chain import JointInput, chain_step, init_states
from envs.actuator.effect import Stage
from envs.errors import InputError
from envs.physics.quiet_mujoco import mujoco
from sysid.excitation.plan import Limits, Plan, Schedule, make_plan
from sysid.mechanism import (
    Mechanism,
    check_two_gains,
    joint_address,
    joint_range,
)

STEP_S = 0.001
_SHRINK = 0.75
_MAX_ROUNDS = 12
_COMMANDS = frozenset((Stage.COMMAND, Stage.PROFILE))
"""Stages at which a target becomes what the servo follows."""


@dataclass(frozen=True, eq=False)
class Rehearsal:
    """What the model does under a plan; arrays are steps of `STEP_S` by joints.

    Attributes:
        angle, speed, torque: of the joints [rad], [rad/s], [N·m].
        touching: names of what touches first at each step, "" if nothing new does.
        broken: (wave, joint, sentence) for every limit that is exceeded.
    """

    angle: Float[np.ndarray, "n j"]
    speed: Float[np.ndarray, "n j"]
    torque: Float[np.ndarray, "n j"]
    touching: tuple[str, ...]
    broken: tuple[tuple[str, str, str], ...]


def fitting_plan(
    mechanism: Mechanism,
    groups: Sequence[Sequence[str]],
    schedule: Schedule,
    limits: Limits,
) -> tuple[Plan, Rehearsal]:
    """Makes a plan whose rehearsal stays within all limits.

    Waves that leave a limit get smaller, joint by joint. Repeats are exact, so one of
    them is rehearsed.

    Args:
        mechanism: the simulation as it stands.
        groups: joints that move at the same time, one group after the other.
        schedule: which waves, how long and how often.
        limits: what to keep to.

    Raises:
        InputError: a wave that leaves a limit even when it is small, or a drive with
            a velocity loop.
    """
    check_two_gains(mechanism, "a plan")
    scales: dict[tuple[str, str], float] = {}
    once = replace(schedule, repeats=1)
    for _ in range(_MAX_ROUNDS):
        plan = make_plan(mechanism, groups, once, limits, scales)
        found = rehearse(mechanism, plan)
        if not found.broken:
            return make_plan(mechanism, groups, schedule, limits, scales), found
        for wave, joint in {(wave, joint) for wave, joint, _ in found.broken}:
            scales[wave, joint] = scales.get((wave, joint), 1.0) * _SHRINK
    wave, joint, what = found.broken[0]
    valid = "a posture and limits that leave room to move"
    raise InputError("plan", f"{wave} of {joint}", what, valid)


def rehearse(mechanism: Mechanism, plan: Plan) -> Rehearsal:
    """Simulates a plan in C MuJoCo with contacts and compares it with its limits."""
    model = copy.deepcopy(mechanism.model)
    model.actuator_gainprm[:] = 0.0  # the drives are those of the mechanism
    model.actuator_biasprm[:] = 0.0
    model.opt.timestep = STEP_S
    data = mujoco.MjData(model)
    qpos, dofs = joint_address(mechanism)
    data.qpos[qpos] = plan.targets[0]
    mujoco.mj_forward(model, data)
    known = _contacts(data)
    commands = _followed(mechanism, plan)
    kp, kd, limit = _drive_limits(mechanism)
    shape = commands.shape
    angle, speed, torque = (np.empty(shape) for _ in range(3))
    touching = []
    for k, command in enumerate(commands):
        angle[k], speed[k] = data.qpos[qpos], data.qvel[dofs]
        wanted = kp * (command - angle[k]) - kd * speed[k]
        torque[k] = np.clip(wanted, -limit, limit)
        data.qfrc_applied[dofs] = torque[k]
        mujoco.mj_step(model, data)
        new = _contacts(data) - known
        touching.append(_names(model, min(new)) if new else "")
    found = Rehearsal(angle, speed, torque, tuple(touching), ())
    return Rehearsal(
        angle, speed, torque, tuple(touching), _broken(mechanism, plan, found)
    )


def _drive_limits(mechanism: Mechanism) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns kp, kd and torque limit of every joint."""
    drives = list(mechanism.drives.values())
    limits = [drive.parameter("torque_limit", "limit_nm", np.inf) for drive in drives]
    kp = np.array([drive.kp.value for drive in drives])
    kd = np.array([drive.kd.value for drive in drives])
    return kp, kd, np.array(limits)


def _followed(mechanism: Mechanism, plan: Plan) -> Float[np.ndarray, "n j"]:
    """Returns what the servos follow: targets after the known command path."""
    steps = round(len(plan.targets) / plan.rate_hz / STEP_S)
    rows = (np.arange(steps) * STEP_S * plan.rate_hz).astype(int)
    held = plan.targets[np.minimum(rows, len(plan.targets) - 1)]
    columns = [
        _path(tuple(drive.effects), _values(drive), jnp.asarray(held[:, j]))
        for j, drive in enumerate(mechanism.drives.values())
    ]
    return np.stack([np.asarray(c, dtype=float) for c in columns], 1)


def _values(drive) -> tuple[dict[str, float], ...]:
    return tuple({k: f.value for k, f in p.items()} for p in drive.effects.values())


@partial(jax.jit, static_argnames="names")
def _path(names, values, held):
    """Runs the effects of the command path on the targets of one joint."""
    model = [
        (effect_kind(name), parameters)
        for name, parameters in zip(names, values, strict=True)
        if not _COMMANDS.isdisjoint(effect_kind(name).acts)
    ]
    zero = jnp.zeros(())

    def step(states, target):
        out = chain_step(model, states, JointInput(target, zero, zero), STEP_S)
        return out[0], out[1].command

    start = init_states(model, held[0], zero, STEP_S)
    return jax.lax.scan(step, start, held)[1]


def _contacts(data: mujoco.MjData) -> set[tuple[int, int]]:
    """Returns the pairs of geoms that touch."""
    if not data.ncon:
        return set()
    pairs = data.contact.geom[data.contact.dist <= 0.0]
    return {(int(a), int(b)) for a, b in pairs}


def _names(model: mujoco.MjModel, pair: tuple[int, int]) -> str:
    bodies = [model.body(model.geom_bodyid[geom]).name for geom in pair]
    return " and ".join(bodies)


def _broken(mechanism, plan: Plan, found: Rehearsal) -> tuple:
    """Lists which wave of which joint leaves which limit."""
    limits, broken = plan.limits, []
    _, _, torque_limits = _drive_limits(mechanism)
    for segment in plan.segments:
        if segment.repeat:
            continue
        rows = slice(round(segment.start_s / STEP_S), round(segment.stop_s / STEP_S))
        touch = next((name for name in found.touching[rows] if name), "")
        for joint in segment.joints:
            j = plan.joints.index(joint)
            limit = limits.torque_share * torque_limits[j]
            what = _leaves(mechanism, joint, limits, found, rows, j, limit)
            what += [f"{touch} touch"] * bool(touch)
            broken += [(segment.wave, joint, sentence) for sentence in what]
    return tuple(broken)


def _leaves(mechanism, joint, limits: Limits, found, rows, j, torque_limit) -> list:
    """Returns sentences on the limits that one joint leaves in some rows."""
    low, high = joint_range(mechanism, joint)
    angle = found.angle[rows, j]
    speed = float(np.max(np.abs(found.speed[rows, j])))
    torque = float(np.max(np.abs(found.torque[rows, j])))
    what = []
    if np.min(angle) < low or np.max(angle) > high:
        what.append(f"{np.min(angle):.3f} to {np.max(angle):.3f} rad")
    if speed > 1.05 * limits.speed_rad_s:
        what.append(f"{speed:.2f} rad/s")
    if torque > torque_limit:
        what.append(f"{torque:.3f} N·m")
    return what
