"""One world of the hand under a task: reset, step and what happens between them."""

from collections.abc import Mapping
from typing import Any

import jax
import jax.numpy as jnp
import mujoco
from jaxtyping import Array, Bool, Float, PRNGKeyArray

from envs.base import State
from envs.hand.effect_parts import friction_rows
from envs.hand.hand_file import HandFile, load_hand_file
from envs.hand.model import PHYSICS_DT_S
from envs.hand.spec import HandSpec
from envs.hand.stance import Stance, stance_of
from envs.memory import Memory, PerWorldState
from envs.observations import InputTerm, Sample, flatten, push, start_history
from envs.physics.backends import make_physics
from envs.physics.base import ModelFields, Physics, PhysicsOutput, PhysicsState
from envs.physics.room import overflow_metrics
from envs.plant import make_plant
from envs.randomize import draw_variation, model_fields
from envs.scene import build_scene
from envs.scoring import scheduled_weights, score
from envs.sensing import imu_of, sense
from envs.signals import Command, Signals, extract_signals
from envs.streams import stream
from envs.task import HandTask
from rewards import RewardTable


class HandEnv:
    """One world of a task on the hand; the caller vmaps it.

    Args:
        task: what the hand is to do.
        backend: physics backend, see `envs.physics`.
        num_worlds: most worlds that are stepped together.
        hand: hand file; the calibrated hand of the paper if not given.
        stance: settled stance of that hand; see `envs.hand.stance.stance_of`.
    """

    def __init__(
        self,
        task: HandTask,
        backend: str = "cpu",
        num_worlds: int = 1,
        hand: HandFile | None = None,
        stance: Stance | None = None,
    ):
        self.task, self.config = task, task.config
        self.hand = hand or load_hand_file()
        self.stance = stance or stance_of(self.hand)
        model = self.build_scene().compile()

        def make(substeps: int) -> Physics:
            return make_physics(
                backend,
                model,
                substeps,
                num_worlds,
                contacts_per_world=self.config.contacts_per_world,
                constraints_per_world=self.config.constraints_per_world
                + friction_rows(model),
            )

        substeps = round(self.dt / PHYSICS_DT_S)
        self.plant = make_plant(make, model, self.hand, self.stance, substeps)
        first = jax.eval_shape(self.reset, jax.random.key(0))
        self._observation_size = {k: x.shape[-1] for k, x in first.obs.items()}

    @property
    def table(self) -> RewardTable:
        """Rows of the reward."""
        return self.task.table

    @property
    def input_terms(self) -> tuple[InputTerm, ...]:
        """The task's inputs to the policy, in their order."""
        return self.task.input_terms

    @property
    def mj_model(self) -> mujoco.MjModel:
        """The scene with the nominal hand."""
        return self.plant.mj_model

    @property
    def physics(self) -> Physics:
        """The backend that steps it."""
        return self.plant.physics

    @property
    def spec(self) -> HandSpec:
        """Indices of the model."""
        return self.plant.spec

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

    @property
    def observation_size(self) -> dict[str, int]:
        """Sizes of the actor's and the critic's observation."""
        return dict(self._observation_size)

    def build_scene(self) -> mujoco.MjSpec:
        """The scene as a specification."""
        return build_scene(self.hand, self.stance.q_off, self.task.add_scene)

    def fields(self, world: PerWorldState) -> ModelFields:
        """All model fields in which a world differs from `mj_model`."""
        fields = model_fields(self.mj_model, self.spec, world.variation)
        fields = self.plant.effects.change(fields)
        return self.task.vary_scene(self.plant, fields, world)

    def reset(self, key: PRNGKeyArray) -> State:
        """Begins a new world: its draw of the randomization and its first episode."""
        config, count = self.config, self.action_size
        world = PerWorldState(
            key=key,
            variation=draw_variation(stream(key, "variation"), config.randomize, count),
            weights=scheduled_weights(
                self.table,
                config.weights,
                config.curriculum_scale,
                config.schedule_scale,
            ),
            total_steps=jnp.zeros((), jnp.int32),
            episodes=jnp.zeros((), jnp.int32),
            **self.task.begin_world(),
        )
        return self._start(world)

    def restart(self, state: State) -> State:
        """Begins the next episode of the same world; nothing else is kept."""
        world = state.memory.world
        return self._start(world.replace(episodes=world.episodes + 1))

    def step(self, state: State, action: Float[Array, " joints"]) -> State:
        """Advances one control step, θ ← clip(θ + α tanh(clip(a, ±c)), joint limits).

        Args:
            state: the state before.
            action: policy output a [1], which moves the joint targets θ [rad].

        Source:
            Paper, policy interfaces.
        """
        config = self.config
        memory, action = self.task.override(self.plant, state.memory, action)
        action = jnp.clip(action, -config.action_clip, config.action_clip)
        target = self.plant.next_target(memory.target, action, config.action_scale_rad)
        drive, output, invalid = self.plant.step(
            self.fields(memory.world), state.data, memory.drive, target
        )
        signals = self.signals(state.data, output, action, vars(memory))
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
        memory, extras = self.task.magnitudes(memory, signals, ~invalid)
        named = vars(signals) | signals.extra | extras
        world, reward, terms = score(self.table, memory.world, named, self.dt, ~invalid)
        terminated = self.task.terminated(signals) & ~invalid
        timeout = memory.steps >= self.episode_length
        truncated = timeout & ~terminated & ~invalid
        memory = self.task.advance(memory.replace(world=world), signals)
        sample = self.sample(output.state, vars(memory))
        memory = memory.replace(history=push(memory.history, sample))
        info = {
            "truncation": truncated.astype(jnp.float32),
            "invalid": invalid.astype(jnp.float32),
            "episode_return": state.info["episode_return"] + reward,
            "episode_length": state.info["episode_length"] + 1.0,
        }
        return State(
            data=output.state,
            obs=self._observations(output.state, signals, vars(memory)),
            reward=reward,
            done=(terminated | timeout | invalid).astype(jnp.float32),
            metrics=self._metrics(terms, signals, output),
            info=info,
            signals=signals,
            memory=memory,
        )

    def _start(self, world: PerWorldState) -> State:
        """First state of an episode."""
        key = jax.random.fold_in(stream(world.key, "episode"), world.episodes)
        data, target = self.task.start(key, self.plant, world)
        action, zero = jnp.zeros(self.action_size), jnp.zeros(())
        carried = self.task.begin_episode(key, world, data) | {
            "world": world,
            "steps": jnp.zeros((), jnp.int32),
            "drive": self.plant.drive.begin(target, data.qpos[self.spec.joint_qpos]),
            "target": target,
            "action": action,
        }
        output = self.plant.rest.replace(state=data)
        signals = self.signals(data, output, action, carried)
        history = start_history(self.sample(data, carried))
        memory = Memory(**carried, history=history)
        names = ("truncation", "invalid", "episode_return", "episode_length")
        terms = {row.name: zero for row in self.table}
        return State(
            data=data,
            obs=self._observations(data, signals, vars(memory)),
            reward=zero,
            done=zero,
            metrics=self._metrics(terms, signals, output),
            info=dict.fromkeys(names, zero),
            signals=signals,
            memory=memory,
        )

    def signals(
        self,
        before: PhysicsState,
        output: PhysicsOutput,
        action: Float[Array, " joints"],
        carried: Mapping[str, Any],
    ) -> Signals:
        """All signals of a control step, s = h(x_t, x_{t+1}, a_t).

        Args:
            before: the state before.
            output: result of the physics.
            action: clipped policy output of this step [1].
            carried: fields of the `Memory` before the step.

        Returns:
            Quantities in SI units ([m], [rad], [N·m]); see `envs.signals`.

        Source:
            Ours.
        """
        asked = Command(carried["command"], action, carried["action"])
        q_off = jnp.array(self.stance.q_off)
        signals = extract_signals(self.spec, q_off, before, output, asked, self.dt)
        extra = self.task.scene_signals(self.plant, carried, signals, output)
        return signals.replace(extra=extra)

    def sample(self, data: PhysicsState, carried: Mapping[str, Any]) -> Sample:
        """What the actor observes, relative to the settled stance.

        Args:
            data: the state that is measured.
            carried: fields of the `Memory` after the step.
        """
        reference, noise = jnp.array(self.stance.joint_pos_rad), self.config.randomize
        effects = self.plant.effects
        drive, q = self.plant.drive, data.qpos[self.spec.joint_qpos]
        joints = drive.reading(carried["drive"], q) - reference
        imu = effects.sense(imu_of(data, effects.down_w))
        sample = sense(noise, carried["world"], joints, imu, carried["action"])
        return sample.replace(inputs=self.task.inputs(carried, sample))

    def _observations(
        self, data: PhysicsState, signals: Signals, carried: Mapping[str, Any]
    ) -> dict[str, Float[Array, " n"]]:
        """The actor's inputs; the critic adds base state, torque and tip force."""
        actor = flatten(carried["history"], self.input_terms)
        base = [data.qpos[2:3], signals.vel_v, signals.angvel_v, signals.gravity_b]
        extra = [*base, signals.torque_nm, signals.tip_force_n]
        extra.append(self.task.privileged(carried, signals))
        return {"state": actor, "privileged_state": jnp.concatenate([actor, *extra])}

    def _metrics(
        self,
        terms: dict[str, Float[Array, ""]],
        signals: Signals,
        output: PhysicsOutput,
    ) -> dict[str, Float[Array, ""]]:
        """Per-step scalars: reward terms, the task's measures, buffer overflow."""
        named = {f"reward/{name}": value for name, value in terms.items()}
        room = overflow_metrics(output.overflow)
        return named | self.task.measures(signals) | room
