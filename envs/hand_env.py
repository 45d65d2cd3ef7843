"""One world of the hand under a task: reset, step and what happens between them."""

from typing import Any

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from jaxtyping import Array, Bool, Float

from envs.base import State
from envs.hand.drive import init_drive_state
from envs.hand.hand_file import HandFile, load_hand_file
from envs.hand.model import PHYSICS_DT_S, build_model
from envs.hand.spec import HandSpec
from envs.hand.stance import Stance, stance_of
from envs.hand_task import HandTask
from envs.memory import Lasting, Memory
from envs.observations import Sample, flatten, push, start_history
from envs.physics import Physics, PhysicsOutput, PhysicsState, make_physics
from envs.plant import make_plant
from envs.randomize import draw_variation
from envs.scoring import scheduled_weights, score
from envs.sensing import sense
from envs.signals import Command, Signals, extract_signals
from envs.streams import stream
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
        model = build_model(self.hand, np.array(self.stance.q_off))
        physics = make_physics(
            backend,
            model,
            round(self.dt / PHYSICS_DT_S),
            num_worlds,
            contacts_per_world=self.config.contacts_per_world,
            constraints_per_world=self.config.constraints_per_world,
        )
        self.plant = make_plant(physics, self.hand, self.stance)
        self._q_off = jnp.array(self.stance.q_off)
        first = jax.eval_shape(self.reset, jax.random.key(0))
        self._observation_size = {k: x.shape[-1] for k, x in first.obs.items()}

    @property
    def table(self) -> RewardTable:
        """Rows of the reward."""
        return self.task.table

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

    def reset(self, key: Array) -> State:
        """Begins a new world: its draw of the randomization and its first episode."""
        config = self.config
        lasting = Lasting(
            key=key,
            variation=draw_variation(stream(key, "variation"), config.randomize),
            weights=scheduled_weights(
                self.table, config.weights, config.curriculum_scale
            ),
            total_steps=jnp.zeros((), jnp.int32),
            episodes=jnp.zeros((), jnp.int32),
            **self.task.begin_world(),
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
        memory, config = state.memory, self.config
        action = jnp.clip(action, -config.action_clip, config.action_clip)
        target = self.plant.next_target(memory.target, action, config.action_scale_rad)
        drive, output, invalid = self.plant.step(
            memory.lasting.variation, state.data, memory.drive, target
        )
        asked = Command(self.task.inputs(vars(memory)), action, memory.action)
        signals = self._signals(state.data, output, asked, self.dt)
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
        named = vars(signals) | extras
        lasting, reward, terms = score(
            self.table, memory.lasting, named, self.dt, ~invalid
        )
        terminated = self.task.terminated(signals) & ~invalid
        timeout = memory.steps >= self.episode_length
        truncated = timeout & ~terminated & ~invalid
        memory = self.task.advance(memory.replace(lasting=lasting))
        sample = self._sample(lasting, output.state, memory.action, vars(memory))
        memory = memory.replace(history=push(memory.history, sample))
        info = {
            "truncation": truncated.astype(jnp.float32),
            "invalid": invalid.astype(jnp.float32),
            "episode_return": state.info["episode_return"] + reward,
            "episode_length": state.info["episode_length"] + 1.0,
        }
        return State(
            data=output.state,
            obs=_observations(memory.history, output.state, signals),
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
        data, target = self.task.start(key, self.plant)
        action, zero = jnp.zeros(self.action_size), jnp.zeros(())
        carried = self.task.begin_episode(key)
        output = self.plant.rest.replace(state=data)
        asked = Command(self.task.inputs(carried), action, action)
        signals = self._signals(data, output, asked, 1.0)
        memory = Memory(
            lasting=lasting,
            steps=jnp.zeros((), jnp.int32),
            drive=init_drive_state(target, self.plant.drive, PHYSICS_DT_S),
            target=target,
            action=action,
            history=start_history(self._sample(lasting, data, action, carried)),
            **carried,
        )
        names = ("truncation", "invalid", "episode_return", "episode_length")
        terms = {row.name: zero for row in self.table}
        return State(
            data=data,
            obs=_observations(memory.history, data, signals),
            reward=zero,
            done=zero,
            metrics=self._metrics(terms, signals, output),
            info=dict.fromkeys(names, zero),
            signals=signals,
            memory=memory,
        )

    def _signals(
        self, before: PhysicsState, output: PhysicsOutput, asked: Command, dt_s: float
    ) -> Signals:
        return extract_signals(self.spec, self._q_off, before, output, asked, dt_s)

    def _sample(
        self,
        lasting: Lasting,
        data: PhysicsState,
        action: Float[Array, "20"],
        carried: dict[str, Any],
    ) -> Sample:
        """What the actor is told, relative to the settled stance."""
        reference, inputs = jnp.array(self.stance.joint_pos_rad), self.task.inputs
        noise = self.config.randomize
        return sense(noise, lasting, reference, data, action, inputs(carried))

    def _metrics(
        self, terms: dict[str, Array], signals: Signals, output: PhysicsOutput
    ) -> dict[str, Array]:
        """Per-step scalars: reward terms, the task's measures, buffer overflow."""
        named = {f"reward/{name}": value for name, value in terms.items()}
        overflow = (output.overflow != 0).astype(jnp.float32)
        return named | self.task.measures(signals) | {"contact_overflow": overflow}


def _observations(
    history: Sample, data: PhysicsState, signals: Signals
) -> dict[str, Array]:
    """The actor's inputs; the critic adds base state, torque and tip force."""
    actor = flatten(history)
    base = [data.qpos[2:3], signals.vel_v, signals.angvel_v, signals.gravity_b]
    extra = [*base, signals.torque_nm, signals.tip_force_n]
    return {"state": actor, "privileged_state": jnp.concatenate([actor, *extra])}
