"""The simulated hand: MuJoCo physics, the command path, sensors with noise.

The one module of this package that imports MuJoCo; it runs in the simulator's process.
"""

import math
from collections.abc import Sequence
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from fingers_deploy.errors import InputError
from fingers_deploy.rotations import multiply
from fingers_robot.drivers.one_file import read_model
from fingers_robot.drivers.sim_packets import STATE
from fingers_robot.simulator.command_path import CommandPath

HEALTH_S = 0.2
EFFORT_AT_LIMIT_A = 1.0  # the torque limit stands for this current
_ATTITUDE_NOISE_RAD, _GYRO_NOISE_RAD_S, _ANGLE_NOISE_RAD = 0.002, 0.01, 1e-4


class SimulatedHand:
    """A hand on the floor, energized or not.

    While de-energized its joints do not follow and, as gear trains that cannot be
    driven backwards, hold by friction.

    Args:
        model: MJCF (.xml) or compiled model (.mjb), with a free root joint and one
            position servo per joint, named as the joint.
        joint_names: the joints, in the order of every joint vector.
        delay_s: transport delay of the command path [s].
        lowpass_hz: its cutoff [Hz].
        slew_rad_s: its speed limit, of each joint or of all [rad/s].
        seed: seed of the sensor noise.

    Raises:
        InputError: the model cannot be read or has not these joints.
    """

    def __init__(
        self,
        model: str | Path,
        joint_names: tuple[str, ...],
        delay_s: float = 0.02,
        lowpass_hz: float | None = 3.0,
        slew_rad_s: Sequence[float] | float = 2.8,
        seed: int = 0,
    ):
        self.model = load_model(model)
        self._source = str(model)
        self.data = mujoco.MjData(self.model)
        ids = [self._actuator(name) for name in joint_names]
        joints = self.model.actuator_trnid[ids, 0]
        self._act, self._qpos = np.array(ids), self.model.jnt_qposadr[joints]
        self._dof = self.model.jnt_dofadr[joints]
        self.joint_limits_rad = self.model.jnt_range[joints].copy()
        self._force = self.model.actuator_forcerange[self._act, 1]
        self._gain = self.model.actuator_gainprm[self._act, 0].copy()
        self._bias = self.model.actuator_biasprm[self._act, :3].copy()
        # Stiff, or the friction of the de-energized joints would creep.
        self.model.dof_solimp[self._dof, :2] = 0.99
        self._rng = np.random.default_rng(seed)
        self.dt_s = float(self.model.opt.timestep)
        if self.model.nkey:
            mujoco.mj_resetDataKeyframe(self.model, self.data, 0)
        mujoco.mj_forward(self.model, self.data)
        self.target_rad = self.data.qpos[self._qpos].copy()
        self._path = CommandPath(
            self.target_rad, self.dt_s, delay_s, lowpass_hz, slew_rad_s
        )
        self._health_s = -math.inf
        self.set_enabled(False)

    def set_enabled(self, enabled: bool) -> None:
        """Energizes or de-energizes all joints; the firmware starts at the position."""
        on = 1.0 if enabled else 0.0
        self.enabled = enabled
        self.model.actuator_gainprm[self._act, 0] = on * self._gain
        self.model.actuator_biasprm[self._act, :2] = on * self._bias[:, :2]
        friction = 0.0 if enabled else 1.0
        self.model.dof_frictionloss[self._dof] = friction * np.abs(self._force)
        self._health_s = -math.inf
        if enabled:
            self._path.reset(self.data.qpos[self._qpos].copy())

    def step(self) -> None:
        """Advances the physics by one step."""
        self.data.ctrl[self._act] = self._path.step(self.target_rad)
        mujoco.mj_step(self.model, self.data)

    def advance(self, t_s: float) -> None:
        """Advances the physics up to a time [s]."""
        while self.data.time + 0.5 * self.dt_s < t_s:
            self.step()

    def state(self, offset_s: float = 0.0) -> NDArray[np.void]:
        """Returns what the sensors measure now.

        Args:
            offset_s: added to the time of the physics to give the clock's time [s].
        """
        now = float(self.data.time) + offset_s
        if now - self._health_s >= HEALTH_S:
            self._health_s = now
        packet, qpos = np.zeros((), STATE), self.data.qpos
        packet["t_s"], packet["health_t_s"] = now, self._health_s
        packet["enabled"] = self.enabled
        noise = self._rng.standard_normal(26)
        packet["pos"] = qpos[self._qpos] + _ANGLE_NOISE_RAD * noise[:20]
        torque = self.data.qfrc_actuator[self._dof]
        packet["effort"] = EFFORT_AT_LIMIT_A * torque / self._force
        half = 0.5 * _ATTITUDE_NOISE_RAD * noise[20:23]
        quat = multiply(qpos[3:7], (1.0, *half))
        packet["quat"] = quat / math.sqrt(float(quat @ quat))
        packet["gyro"] = self.data.qvel[3:6] + _GYRO_NOISE_RAD_S * noise[23:]
        packet["base_pos"], packet["base_quat"] = qpos[:3], qpos[3:7]
        return packet

    def _actuator(self, joint: str) -> int:
        kinds = mujoco.mjtObj
        found = mujoco.mj_name2id(self.model, kinds.mjOBJ_ACTUATOR, joint)
        if found < 0 or not self.model.actuator_forcelimited[found]:
            valid = "one position servo with a torque limit per joint of the policy"
            raise InputError(self._source, "actuators", f"none for {joint}", valid)
        return found


def load_model(path: str | Path) -> mujoco.MjModel:
    """Reads a model that stands for itself: no includes, no files beside it.

    Raises:
        InputError: the file cannot be read, is no such model, or holds numbers that no
            hand has.
    """
    path = Path(path)
    data = read_model(path)
    try:
        if path.suffix == ".mjb":
            model = mujoco.MjModel.from_binary_path(str(path))
        else:
            model = mujoco.MjModel.from_xml_string(data.decode("utf-8"))
    except (ValueError, UnicodeDecodeError) as error:
        valid = "an MJCF or MJB model without other files"
        raise InputError(path, "", error, valid) from error
    _check(model, path)
    return model


def _check(model: mujoco.MjModel, path: Path) -> None:
    step = float(model.opt.timestep)
    if not 1e-4 <= step <= 0.02:
        raise InputError(path, "option.timestep", step, "0.0001 to 0.02 s")
    for name in ("body_mass", "body_inertia", "jnt_range", "qpos0", "geom_size"):
        if not np.isfinite(getattr(model, name)).all():
            raise InputError(path, name, "NaN or infinity", "finite numbers")
    free = model.njnt and model.jnt_type[0] == mujoco.mjtJoint.mjJNT_FREE
    if not free:
        raise InputError(path, "first joint", "not free", "a free root joint")
