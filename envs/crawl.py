"""The crawl task: follow planar velocity and yaw-rate commands on five fingertips."""

from dataclasses import dataclass, field
from functools import cached_property

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from jaxtyping import Array, Bool, Float

from envs.base import State
from envs.commands import CommandConfig, sample_command
from envs.hand.drive import command_sequence, drive_params, init_drive_state
from envs.hand.figures import figures
from envs.hand.hand_file import HandFile, load_hand_file
from envs.hand.model import PHYSICS_DT_S, build_model
from envs.hand.spec import HandSpec, hand_spec
from envs.hand.stance import Stance, load_stance
from envs.memory import Lasting, Memory
from envs.observations import Sample, flatten, push, start_history
from envs.physics import PhysicsOutput, PhysicsState, make_physics
from envs.randomize import RandomizeConfig, draw_variation, model_fields
from envs.rotations import about_z, from_vector, multiply, rotate
from envs.signals import Command, Signals, extract_signals, gravity
from envs.streams import stream
from rewards import (
    CRAWL,
    Constant,
    GeometricDecay,
    LiftParams,
    RewardTable,
    Schedule,
    StepSwitch,
    evaluate,
    footprint_step,
    init_footprint_memory,
    init_lift_memory,
    lift_step,
    safe_norm,
    table_weights,
    weights_at,
)


@dataclass(frozen=True)
class CrawlConfig:
    """Settings of the crawl task.

    Attributes:
        episode_s: episode length (paper).
        control_dt_s: control interval (paper: 50 Hz).
        action_scale_rad: α, joint-target increment at full action (paper).
        action_clip: the policy output is clipped to ± this (ours; the paper clips
            without giving the bound).
        max_roll_deg, max_pitch_deg: tilt of V that ends the episode (paper).
        reset_joint_rad: largest joint offset at reset (ours).
        reset_speed_mps: largest base speed at reset, each axis (ours).
        curriculum_scale: factor on the steps of the reward schedules; 1 is the
            paper's, which is made for 8,000 iterations of 24 steps.
        weights: reward weights that replace the start value of the table's.
        command: ranges of the commands.
        randomize: domain randomization.
    """

    episode_s: float = field(default=20.0, metadata={"unit": "s", "low": 0.1})
    control_dt_s: float = field(default=0.02, metadata={"unit": "s", "low": 0.005})
    action_scale_rad: float = field(default=0.060, metadata={"unit": "rad", "low": 0.0})
    action_clip: float = field(default=3.0, metadata={"unit": "1", "low": 0.1})
    max_roll_deg: float = field(default=35.0, metadata={"unit": "deg", "low": 1.0})
    max_pitch_deg: float = field(default=30.0, metadata={"unit": "deg", "low": 1.0})
    reset_joint_rad: float = field(default=0.05, metadata={"unit": "rad", "low": 0.0})
    reset_speed_mps: float = field(default=0.05, metadata={"unit": "m/s", "low": 0.0})
    curriculum_scale: float = field(default=1.0, metadata={"unit": "1", "low": 1e-3})
    weights: dict[str, float] = field(default_factory=dict)
    command: CommandConfig = field(default_factory=CommandConfig)
    randomize: RandomizeConfig = field(default_factory=RandomizeConfig)


class CrawlEnv:
    """One world of the crawl task; the caller vmaps it.

    Args:
        config: settings of the task.
        backend: physics backend, see `envs.physics`.
        num_worlds: most worlds that are stepped together.
        hand: hand file; the calibrated hand of the paper if not given.
        stance: settled stance of that hand; the stored one if not given.
    """

    def __init__(
        self,
        config: CrawlConfig | None = None,
        backend: str = "cpu",
        num_worlds: int = 1,
        hand: HandFile | None = None,
        stance: Stance | None = None,
    ):
        self.config = config or CrawlConfig()
        self.hand = hand or load_hand_file()
        self.stance = stance or load_stance()
        self.table: RewardTable = CRAWL
        self.mj_model = build_model(self.hand, np.array(self.stance.q_off))
        substeps = round(self.config.control_dt_s / PHYSICS_DT_S)
        self.physics = make_physics(backend, self.mj_model, substeps, num_worlds)
        nominal = [figures().per_joint(k) for k in ("kp", "kv", "force_limit")]
        self._drive = drive_params(self.hand, *nominal)
        self._drive = jax.tree.map(lambda x: jnp.asarray(x, jnp.float32), self._drive)
        self._q_off = jnp.array(self.stance.q_off)
        self._limits = jnp.asarray(self.spec.joint_range_rad, jnp.float32)
        self._rest = _output_at_rest(self.mj_model, self.stance)

    @cached_property
    def spec(self) -> HandSpec:
        """Indices of the model."""
        return hand_spec(self.mj_model)

    @property
    def dt(self) -> float:
        """Control interval [s]."""
        return self.config.control_dt_s

    @property
    def episode_length(self) -> int:
        """Control steps of an episode."""
        return round(self.config.episode_s / self.dt)

    @property
    def action_size(self) -> int:
        """Size of the policy output."""
        return self.mj_model.nu

    @cached_property
    def observation_size(self) -> dict[str, int]:
        """Sizes of the actor's and the critic's observation."""
        state = jax.eval_shape(self.reset, jax.random.key(0))
        return {name: x.shape[-1] for name, x in state.obs.items()}

    def reset(self, key: Array) -> State:
        """Begins a new world: its draw of the randomization and its first episode."""
        lasting = Lasting(
            key=key,
            variation=draw_variation(stream(key, "variation"), self.config.randomize),
            footprint=init_footprint_memory(),
            weights=self._default_weights(),
            total_steps=jnp.zeros((), jnp.int32),
            episodes=jnp.zeros((), jnp.int32),
        )
        return self._start(lasting)

    def restart(self, state: State) -> State:
        """Begins the next episode of the same world; nothing else is kept."""
        lasting = state.memory.lasting
        return self._start(lasting.replace(episodes=lasting.episodes + 1))

    def step(self, state: State, action: Float[Array, "20"]) -> State:
        """Advances one control step.

        Args:
            state: the state before.
            action: policy output; clipped, squashed by tanh, scaled and added to the
                joint targets.
        """
        memory, limit = state.memory, self.config.action_clip
        action = jnp.clip(action, -limit, limit)
        target = self._next_target(memory.target, action)
        drive, commands = command_sequence(
            self._drive, memory.drive, target, PHYSICS_DT_S, self.physics.n_substeps
        )
        fields = model_fields(self.mj_model, self.spec, memory.lasting.variation)
        output = self.physics.step(fields, state.data, commands)
        output, invalid = self._replace_invalid(output)
        asked = Command(memory.command, action, memory.action)
        signals = extract_signals(
            self.spec, self._q_off, state.data, output, asked, self.dt
        )
        memory = memory.replace(
            drive=drive, target=target, action=action, steps=memory.steps + 1
        )
        return self._finish(state, memory, output, signals, invalid)

    def _finish(
        self,
        state: State,
        memory: Memory,
        output: PhysicsOutput,
        signals: Signals,
        invalid: Bool[Array, ""],
    ) -> State:
        """Rewards, ends and observes a step whose physics is done."""
        memory, reward, terms = self._reward(memory, signals, ~invalid)
        terminated = self._terminated(signals) & ~invalid
        timeout = memory.steps >= self.episode_length
        truncated = timeout & ~terminated & ~invalid
        memory = self._resample(memory)
        memory, obs = self._observe(memory, output.state, signals)
        info = {
            "truncation": truncated.astype(jnp.float32),
            "invalid": invalid.astype(jnp.float32),
            "episode_return": state.info["episode_return"] + reward,
            "episode_length": state.info["episode_length"] + 1.0,
        }
        return State(
            data=output.state,
            obs=obs,
            reward=reward,
            done=(terminated | timeout | invalid).astype(jnp.float32),
            metrics=self._metrics(terms, signals, output),
            info=info,
            signals=signals,
            memory=memory,
        )

    def _start(self, lasting: Lasting) -> State:
        """First state of an episode."""
        key = jax.random.fold_in(stream(lasting.key, "episode"), lasting.episodes)
        data = self._initial_data(key)
        target = jnp.array(self.stance.target_rad)
        action = jnp.zeros(self.action_size)
        command = sample_command(key, self.config.command)
        output = self._rest.replace(state=data)
        signals = extract_signals(
            self.spec, self._q_off, data, output, Command(command, action, action), 1.0
        )
        zero = jnp.zeros(())
        memory = Memory(
            lasting=lasting,
            steps=jnp.zeros((), jnp.int32),
            drive=init_drive_state(target, self._drive, PHYSICS_DT_S),
            target=target,
            action=action,
            history=start_history(self._sample(lasting, data, action, command)),
            command=command,
            lift=init_lift_memory(),
        )
        names = ("truncation", "invalid", "episode_return", "episode_length")
        terms = {row.name: zero for row in self.table}
        return State(
            data=data,
            obs=self._obs(memory.history, data, signals),
            reward=zero,
            done=zero,
            metrics=self._metrics(terms, signals, output),
            info=dict.fromkeys(names, zero),
            signals=signals,
            memory=memory,
        )

    def _initial_data(self, key: Array) -> PhysicsState:
        """The stance with noise, at a random heading."""
        joint, speed = self.config.reset_joint_rad, self.config.reset_speed_mps
        pose = self._rest.state.qpos
        heading = about_z(
            jax.random.uniform(
                stream(key, "heading"), (), minval=-jnp.pi, maxval=jnp.pi
            )
        )
        joints = pose[7:] + jax.random.uniform(
            stream(key, "joints"), (20,), minval=-joint, maxval=joint
        )
        vel = jax.random.uniform(
            stream(key, "speed"), (3,), minval=-speed, maxval=speed
        )
        qpos = jnp.concatenate(
            [
                pose[:3],
                multiply(heading, pose[3:7]),
                jnp.clip(joints, self._limits[:, 0], self._limits[:, 1]),
            ]
        )
        qvel = jnp.zeros(self.mj_model.nv).at[:3].set(vel)
        return PhysicsState(qpos=qpos, qvel=qvel, qacc_warmstart=jnp.zeros_like(qvel))

    def _next_target(
        self, target: Float[Array, "20"], action: Float[Array, "20"]
    ) -> Float[Array, "20"]:
        """Target ← clip(target + α tanh(a), joint limits) (paper, policy interfaces)."""
        moved = target + self.config.action_scale_rad * jnp.tanh(action)
        return jnp.clip(moved, self._limits[:, 0], self._limits[:, 1])

    def _replace_invalid(
        self, output: PhysicsOutput
    ) -> tuple[PhysicsOutput, Bool[Array, ""]]:
        """Puts the stance in the place of a non-finite result, which ends the episode.

        The step counts as invalid and pays nothing; nothing that it computed is used.
        """
        leaves = jax.tree.leaves((output.state, output.sensordata))
        finite = jnp.all(jnp.stack([jnp.all(jnp.isfinite(x)) for x in leaves]))
        rest = self._rest.replace(overflow=output.overflow)
        return jax.tree.map(lambda a, b: jnp.where(finite, a, b), output, rest), ~finite

    def _default_weights(self) -> dict:
        """Weights of the table with the config's values and curriculum."""
        weights = table_weights(self.table, None)
        for name, value in self.config.weights.items():
            weights = weights | {name: _with_value(weights[name], value)}
        return {
            k: _with_time_scale(w, self.config.curriculum_scale)
            for k, w in weights.items()
        }

    def _reward(
        self, memory: Memory, signals: Signals, valid: Bool[Array, ""]
    ) -> tuple[Memory, Float[Array, ""], dict[str, Float[Array, ""]]]:
        """Steps the memories of the rewards and evaluates the table."""
        lasting = memory.lasting
        footprint = footprint_step(lasting.footprint, signals.tip_pos_v)
        footprint = jax.tree.map(
            lambda new, old: jnp.where(valid, new, old), footprint, lasting.footprint
        )
        lift, lift_magnitude = lift_step(
            memory.lift,
            signals.tip_vel_v[:, 2],
            signals.tip_force_n,
            signals.command[:2],
            self.dt,
            LiftParams(),
        )
        named = vars(signals) | {
            "footprint_target_v": footprint.target_v,
            "lift_magnitude": lift_magnitude,
        }
        weights = weights_at(lasting.weights, lasting.total_steps)
        total, terms = evaluate(self.table, named, weights, self.dt)
        lasting = lasting.replace(
            footprint=footprint, total_steps=lasting.total_steps + 1
        )
        paid = jax.tree.map(lambda x: jnp.where(valid, x, 0.0), (total, terms))
        return memory.replace(lasting=lasting, lift=lift), *paid

    def _terminated(self, signals: Signals) -> Bool[Array, ""]:
        """Palm contact, or V tilted beyond the limits (paper)."""
        limits = jnp.deg2rad(
            jnp.array([self.config.max_roll_deg, self.config.max_pitch_deg])
        )
        fallen = jnp.any(jnp.abs(signals.tilt_rad) > limits)
        return fallen | (signals.palm_contact > 0)

    def _resample(self, memory: Memory) -> Memory:
        """Draws the next command when its time has come, and resets the lift memory."""
        period = round(self.config.command.resample_s / self.dt)
        due = memory.steps % period == 0
        key = jax.random.fold_in(
            stream(memory.lasting.key, "resample"), memory.lasting.total_steps
        )
        fresh = (sample_command(key, self.config.command), init_lift_memory())
        command, lift = jax.tree.map(
            lambda new, old: jnp.where(due, new, old),
            fresh,
            (memory.command, memory.lift),
        )
        return memory.replace(command=command, lift=lift)

    def _observe(
        self, memory: Memory, data: PhysicsState, signals: Signals
    ) -> tuple[Memory, dict[str, Array]]:
        """Appends a sample to the history and builds both observations."""
        sample = self._sample(memory.lasting, data, memory.action, memory.command)
        history = push(memory.history, sample)
        return memory.replace(history=history), self._obs(history, data, signals)

    def _sample(
        self,
        lasting: Lasting,
        data: PhysicsState,
        action: Float[Array, "20"],
        command: Float[Array, "3"],
    ) -> Sample:
        """What the sensors tell, with the world's bias and fresh noise."""
        config, variation = self.config.randomize, lasting.variation
        key = jax.random.fold_in(stream(lasting.key, "noise"), lasting.total_steps)
        key = jax.random.fold_in(key, lasting.episodes)

        def noisy(name: str, value: Array, bound: float) -> Array:
            noise = jax.random.uniform(stream(key, name), value.shape, minval=-1.0)
            return value + bound * noise

        imu = from_vector(variation.imu_rotation_rad)
        reference = jnp.array(self.stance.joint_pos_rad)
        joints = data.qpos[7:] - reference
        down = noisy("gravity", gravity(data.qpos[3:7]), config.gravity_noise)
        angvel = data.qvel[3:6] + variation.gyro_bias_rps
        return Sample(
            joint_pos=noisy("joints", joints, config.joint_noise_rad),
            gravity=rotate(imu, down / safe_norm(down)),
            angvel=noisy("gyro", rotate(imu, angvel), config.gyro_noise_rps),
            action=action,
            command=command,
        )

    def _obs(
        self, history: Sample, data: PhysicsState, signals: Signals
    ) -> dict[str, Array]:
        """The actor's 392 inputs; the critic adds base state, torque and tip force."""
        actor = flatten(history)
        base = [data.qpos[2:3], signals.vel_v, signals.angvel_v, signals.gravity_b]
        extra = [*base, signals.torque_nm, signals.tip_force_n]
        return {"state": actor, "privileged_state": jnp.concatenate([actor, *extra])}

    def _metrics(
        self, terms: dict[str, Array], signals: Signals, output: PhysicsOutput
    ) -> dict[str, Array]:
        """Per-step scalars: reward terms, speed along the command, buffer overflow."""
        planar = signals.command[:2]
        speed = jnp.sum(signals.vel_v[:2] * planar) / jnp.maximum(
            safe_norm(planar), 1e-6
        )
        named = {f"reward/{name}": value for name, value in terms.items()}
        return named | {
            "task_speed_mps": speed,
            "contact_overflow": (output.overflow != 0).astype(jnp.float32),
        }


def _output_at_rest(model: mujoco.MjModel, stance: Stance) -> PhysicsOutput:
    """The settled stance with the sensors that belong to it."""
    data = mujoco.MjData(model)
    data.qpos[:], data.ctrl[:] = stance.qpos, stance.target_rad
    mujoco.mj_forward(model, data)
    vectors = (data.qpos, np.zeros(model.nv), np.zeros(model.nv), data.sensordata)
    *state, sensordata = (jnp.asarray(x, jnp.float32) for x in vectors)
    return PhysicsOutput(PhysicsState(*state), sensordata, jnp.zeros((), jnp.int32))


def _with_value(schedule: Schedule, value: float) -> Schedule:
    """Replaces the weight that a schedule starts, or after a switch ends, with."""
    field_name = {Constant: "value", StepSwitch: "after", GeometricDecay: "start"}
    return schedule.replace(
        **{field_name[type(schedule)]: jnp.asarray(value, jnp.float32)}
    )


def _with_time_scale(schedule: Schedule, scale: float) -> Schedule:
    """Stretches the steps at which a schedule changes."""
    steps = ("at_steps", "hold_steps", "decay_steps")
    stretched = {k: v * scale for k, v in vars(schedule).items() if k in steps}
    return schedule.replace(**stretched)
