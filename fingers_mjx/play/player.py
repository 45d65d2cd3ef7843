"""The closed loop in plain C MuJoCo: physics at 200 Hz, the deployment shim at 50 Hz.

`mujoco.mj_step` moves one hand, `fingers_deploy.PolicyController` moves its targets, as
it would on the real hand. Of the training environment only the definitions are used:
how worlds are drawn, the drive between target and servo, what the sensors measure, and
when a hand has fallen. Physics runs in float64 and never through JAX.
"""

import copy
import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from jaxtyping import Array, Float

from envs.actuator.effect import Params
from envs.base import State
from envs.batch import BatchEnv
from envs.hand.drive.drive import DriveState
from envs.memory import Memory, PerWorldState
from envs.observations import Sample
from envs.physics.base import ModelFields, PhysicsOutput, PhysicsState, nominal_field
from fingers_deploy import Bundle, PolicyController
from fingers_deploy.policy import Runtime
from fingers_mjx.evaluation.record import Trace, record
from fingers_mjx.play.inputs import PlayInputs

Schedule = Float[np.ndarray, "steps 3"]


@dataclass
class Episode:
    """A world in the middle of an episode; `Player.step` changes it.

    Attributes:
        model: the world's own, in C MuJoCo.
        data: its state.
        memory: what the environment would carry.
    """

    model: mujoco.MjModel
    data: mujoco.MjData
    memory: Memory


@dataclass(frozen=True)
class Played:
    """One episode.

    Attributes:
        trace: of every control step up to the fall, time first.
        qpos: generalized positions, one more than steps.
        held: steps in which the shim held its target because of a fault.
    """

    trace: Trace
    qpos: Float[np.ndarray, "frames nq"]
    held: int


class Player:
    """Plays episodes of one policy in the worlds of one environment.

    Args:
        env: worlds, drive and sensors of the task; its physics is not used.
        bundle: the exported policy.
        runtime: what runs the policy.

    Raises:
        BundleError: the joints of the bundle are not those of the hand.
    """

    def __init__(self, env: BatchEnv, bundle: Bundle, runtime: Runtime = "auto"):
        self.env = env
        self.controller = PolicyController(bundle, runtime)
        self.controller.check_joint_order(env.spec.joints)
        self._inputs = PlayInputs(env)
        self._reset = jax.jit(env.env.reset)
        self._read: Callable[..., Sample] = jax.jit(self._reading)
        self._act: Callable[..., Any] = jax.jit(env.plant.drive.act)
        self._fields: Callable[..., Any] = jax.jit(env.fields)
        self._judge: Callable[..., Any] = jax.jit(self._judged)

    def play(self, key: Array, steps: int, schedule: Schedule | None = None) -> Played:
        """Plays one episode, to its end or until the hand falls.

        Args:
            key: of the world, as `env.reset` takes it.
            steps: control steps.
            schedule: a command for each step; drawn as in training if not given.
        """
        episode, rows, held = self.begin(key), [], 0
        poses = [episode.data.qpos.copy()]
        while len(rows) < steps and not (rows and rows[-1].done):
            command = None if schedule is None else schedule[len(rows)]
            rows.append(self.step(episode, command))
            poses.append(episode.data.qpos.copy())
            held += self.controller.faults > 0
        trace = jax.tree.map(lambda *x: np.stack(x), *rows)
        return Played(trace, np.stack(poses), held)

    def begin(self, key: Array) -> Episode:
        """Begins an episode; the shim begins with it.

        Args:
            key: of the world, as `env.reset` takes it.
        """
        start = self._reset(key)
        model = varied_model(self.env, start.memory.world)
        data = mujoco.MjData(model)
        data.qpos[:], data.qvel[:] = start.data.qpos, start.data.qvel
        self.controller.reset(np.asarray(start.memory.target))
        self._inputs.begin(start.memory)
        return Episode(model, data, start.memory)

    def step(
        self, episode: Episode, command: Float[np.ndarray, "3"] | None = None
    ) -> Trace:
        """Advances an episode by a control step; returns the step's part of the trace.

        Args:
            episode: from `begin`, not over yet.
            command: v_x, v_y [m/s] and yaw rate [rad/s]; the environment's if None.
        """
        memory, data = episode.memory, episode.data
        if command is not None:
            memory = dataclasses.replace(memory, command=jnp.asarray(command))
        before = _state(data)
        target = self._target(memory, before)
        drive = self._advance(episode.model, data, memory, target)
        memory = dataclasses.replace(memory, drive=drive)
        judged = self._judge(memory, before, _output(data), self.action)
        memory, row = judged
        # As in training, signals of a step know the target before it.
        target = jnp.asarray(target, memory.target.dtype)
        episode.memory = dataclasses.replace(memory, target=target)
        return jax.device_get(row)

    def take_over(self, other: "Player") -> None:
        """Goes on with the shim of another player, its history and its targets."""
        self.controller, self._inputs = other.controller, other._inputs

    def set_effects(self, params: tuple[Params, ...]) -> None:
        """Changes the parameters of the drive's effects, without compiling anew.

        Args:
            params: of the chain of this hand, in its order.
        """
        self._act = partial(self._act_with, params)

    @cached_property
    def _act_with(self) -> Callable[..., Any]:
        chain: Any = self.env.plant.drive
        return jax.jit(lambda p, *args: dataclasses.replace(chain, params=p).act(*args))

    @property
    def action(self) -> Float[np.ndarray, " joints"]:
        """Last clipped policy output."""
        return self.controller.action

    def _target(
        self, memory: Memory, state: PhysicsState
    ) -> Float[np.ndarray, " joints"]:
        """Returns what the shim makes of what the sensors measure."""
        sensed = self._read(memory, state)
        reference = np.asarray(self.env.stance.joint_pos_rad, np.float32)
        joint_pos = np.asarray(sensed.joint_pos) + reference
        return self.controller.step(
            joint_pos,
            np.asarray(sensed.gravity),
            np.asarray(sensed.angvel),
            self._task_inputs(memory, sensed, joint_pos),
        )

    def _task_inputs(
        self, memory: Memory, sensed: Sample, joint_pos: Float[np.ndarray, " joints"]
    ) -> Float[np.ndarray, " inputs"]:
        del joint_pos
        return self._inputs.read(memory, sensed)

    def _reading(self, memory: Memory, state: PhysicsState) -> Sample:
        return self.env.sample(state, vars(memory))

    def _advance(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        memory: Memory,
        target: Float[np.ndarray, " joints"],
    ) -> DriveState:
        """Advances C MuJoCo by a control step; returns the drive's new state."""
        drive, state = self.env.plant.drive, memory.drive
        fields = self._fields(memory.world)
        for _ in range(drive.rounds):
            state, changed, commands = self._act(state, fields, _state(data), target)
            _write(model, changed)
            for command in np.asarray(commands, float):
                data.ctrl[:] = command
                mujoco.mj_step(model, data)
            state = drive.observe(state, _output(data))
        return state

    def _judged(
        self,
        memory: Memory,
        before: PhysicsState,
        output: PhysicsOutput,
        action: Float[Array, " joints"],
    ) -> tuple[Memory, Trace]:
        """Returns the memory for the next step and this step's part of the trace."""
        env = self.env
        signals = env.signals(before, output, action, vars(memory))
        finite = jnp.all(jnp.isfinite(output.state.qpos))
        # Nothing here depends on what the rewards remember; pictures show it.
        memory, _ = env.task.magnitudes(memory, signals, finite)
        done = (env.task.terminated(signals) | ~finite).astype(jnp.float32)
        row = record(_judged_state(signals, done))
        count = memory.world.total_steps + 1
        after = dataclasses.replace(
            memory,
            world=dataclasses.replace(memory.world, total_steps=count),
            action=action,
            steps=memory.steps + 1,
        )
        return env.task.advance(after, signals), row


def varied_model(env: BatchEnv, world: PerWorldState) -> mujoco.MjModel:
    """Returns the model of a world for C MuJoCo, which stops where it diverges.

    Args:
        env: of the nominal model.
        world: the world.
    """
    model = copy.copy(env.mj_model)
    _write(model, env.fields(world))
    # The compiler notes where a body's inertial frame is the body's own; no more.
    model.body_sameframe[:] = mujoco.mjtSameFrame.mjSAMEFRAME_NONE
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    return model


def _write(model: mujoco.MjModel, fields: ModelFields) -> None:
    for name, value in fields.items():
        nominal_field(model, name)[:] = np.asarray(value)


def _state(data: mujoco.MjData) -> PhysicsState:
    vectors = (data.qpos, data.qvel, data.qacc_warmstart)
    return PhysicsState(*(jnp.asarray(x, jnp.float32) for x in vectors))


def _output(data: mujoco.MjData) -> PhysicsOutput:
    sensors = jnp.asarray(data.sensordata, jnp.float32)
    return PhysicsOutput(_state(data), sensors, jnp.zeros((), jnp.int32))


def _judged_state(signals: Any, done: Array) -> State:
    """What `record` reads of a state; a fall is no time limit."""
    zero = jnp.zeros(())
    info = {"truncation": zero}
    return State(None, {}, zero, done, {}, info, signals, None)
