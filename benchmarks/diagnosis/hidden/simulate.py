"""Runs a hidden mechanism under given targets."""

from dataclasses import dataclass

import mujoco
import numpy as np

from benchmarks.diagnosis.hidden.joint_drive import JointDrive
from benchmarks.diagnosis.hidden.plant import STEP_S, build
from benchmarks.diagnosis.hidden.truth import Mechanism


@dataclass(frozen=True)
class Motion:
    """What happened, at every physics step; arrays are steps by joints.

    Attributes:
        t_s: times [s].
        angle, speed: of the links [rad], [rad/s].
        encoder: readings of the encoders [rad].
        torque: of the motors [N·m].
    """

    t_s: np.ndarray
    angle: np.ndarray
    speed: np.ndarray
    encoder: np.ndarray
    torque: np.ndarray


def simulate(
    mechanism: Mechanism,
    times: np.ndarray,
    targets: np.ndarray,
    start: np.ndarray | None = None,
    step_s: float = STEP_S,
) -> Motion:
    """Simulates from rest.

    Args:
        mechanism: the truth.
        times: when each row of targets is sent, increasing [s].
        targets: targets of every joint (rows by joints) [rad].
        start: angles at the beginning; the first targets if not given [rad].
        step_s: step [s].
    """
    plant = build(mechanism, step_s)
    model, data = plant.model, mujoco.MjData(plant.model)
    start = targets[0] if start is None else start
    for where in (plant.link, plant.motor):
        data.qpos[list(where)] = start
    mujoco.mj_forward(model, data)
    ticks = times.tolist()
    drives = [
        JointDrive(joint, ticks, targets[:, i].tolist(), step_s)
        for i, joint in enumerate(mechanism.joints)
    ]
    for drive, at in zip(drives, plant.link, strict=True):
        # An integral has had its time to bear the weight.
        drive.integral = data.qfrc_bias.item(at) if drive.k_int else 0.0
    # A tick that comes late in the last step still needs a sample after it.
    steps = int(np.ceil(times[-1] / step_s)) + 2
    return _run(mechanism, plant, data, drives, steps, step_s)


def _run(mechanism, plant, data, drives, steps: int, h: float) -> Motion:
    model, n = plant.model, len(drives)
    pairs = list(zip(range(n), drives, plant.link, plant.motor, strict=True))
    out = np.empty((steps, 4, n))
    couplings = _couplings(mechanism)
    applied, strength = data.qfrc_applied, 1.0
    qpos, qvel, qacc, bias = data.qpos, data.qvel, data.qacc, data.qfrc_bias
    forces = [0.0] * n
    for k in range(steps):
        t = k * h
        total = 0.0
        for i, drive, link, motor in pairs:
            q, v, qm = qpos.item(link), qvel.item(link), qpos.item(motor)
            # MuJoCo's speeds are half a step older than its angles.
            speed = qvel.item(motor) + 0.5 * h * qacc.item(motor)
            torque = drive.drive(t, qm, speed, strength)
            forces[i] = drive.resist(q, v, -bias.item(link))
            total += abs(torque)
            row = out[k]
            row[0, i], row[1, i] = q, v
            row[2, i], row[3, i] = drive.encoder(qm), torque
        for i, j, stiffness in couplings:
            forces[i] -= stiffness * qpos.item(plant.link[j])
        applied[:] = 0.0
        for i, drive, link, motor in pairs:
            applied[link] += forces[i]
            applied[motor] += drive.torque
        strength = 1.0 / (1.0 + mechanism.sag_per_nm * total / strength)
        mujoco.mj_step(model, data)
    return Motion(h * np.arange(steps), out[:, 0], out[:, 1], out[:, 2], out[:, 3])


def _couplings(mechanism: Mechanism) -> list[tuple[int, int, float]]:
    """Pairs of a joint and the joint whose angle pulls it, with the stiffness."""
    found = []
    for i, joint in enumerate(mechanism.joints):
        effect = joint.effects.get("joint_coupling")
        if effect:
            found.append((i, int(effect["other"]), effect["stiffness_nm_rad"]))
    return found
