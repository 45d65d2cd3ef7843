"""Object pushing: walk to a cube and push it to a target that is fixed in the world."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import flax.struct
import jax
import jax.numpy as jnp
import mujoco
from jaxtyping import Array, Bool, Float, PRNGKeyArray, Shaped

from envs.config.settings.push import PushConfig, Range
from envs.hand.hand_file import HandFile
from envs.hand.stance import Stance
from envs.memory import Memory, PerWorldState
from envs.observations import InputTerm, Sample
from envs.physics.base import ModelFields, PhysicsOutput, PhysicsState
from envs.plant import Plant
from envs.rotations import multiply, unrotate
from envs.signals import Signals
from envs.streams import stream
from envs.tasks.gait import Walking
from envs.tasks.push.camera import (
    CameraState,
    Frame,
    read_camera,
    start_camera,
    step_camera,
)
from envs.tasks.push.guide import POCKET_V, cube_v, guidance, heading
from envs.tasks.push.load import load_signals, stopped
from envs.tasks.push.measures import push_measures
from envs.tasks.push.scene import CUBE, HALF_M, POS, VEL, add_cube, place_cube
from envs.tasks.push.tracking import Track, start_track, step_track, track_inputs
from envs.tasks.upright import fallen, near_stance
from rewards import (
    PUSH,
    RewardTable,
    object_delivered,
    safe_norm,
)

INPUTS = (
    InputTerm("object_pos", 3, "V", "m"),
    InputTerm("object_vel", 3, "V", "m/s"),
    InputTerm("object_to_target", 3, "V", "m"),
)


@flax.struct.dataclass
class PushMemory:
    """What an episode of pushing carries.

    Attributes:
        target_w: where the cube is to go, on the floor [m].
        distance_m: how far that was at the start.
        error_m: how far it is now.
        camera: samples on their way.
        track: what the shim would make of them.
    """

    target_w: Float[Array, "*b 2"]
    distance_m: Float[Array, "*b"]
    error_m: Float[Array, "*b"]
    camera: CameraState
    track: Track


@dataclass(frozen=True)
class Push(Walking):
    """Object pushing as `envs.task.HandTask`.

    Attributes:
        config: settings of the task.
        stance: settled stance of the hand, which defines V.
        tips: fingertips of the hand.
        table: rows of the reward.
    """

    config: PushConfig
    stance: Stance
    tips: int = field(default=5, kw_only=True)
    table: RewardTable = PUSH

    @classmethod
    def on(cls, config: PushConfig, hand: HandFile, stance: Stance) -> "Push":
        """The task for a hand that stands in its settled stance."""
        del hand
        return cls(config, stance, tips=len(stance.footprint_v))

    @property
    def input_terms(self) -> tuple[InputTerm, ...]:
        """Object position, velocity and way to the target (paper)."""
        return INPUTS

    def add_scene(self, spec: mujoco.MjSpec) -> None:
        """The cube."""
        low, high = self.config.object_friction
        add_cube(spec, (low + high) / 2)

    def vary_scene(
        self, plant: Plant, fields: ModelFields, world: PerWorldState
    ) -> ModelFields:
        """The cube's friction."""
        cube = plant.mj_model.geom(CUBE).id
        friction = _uniform(world.key, "cube", self.config.object_friction)
        changed = fields["geom_friction"].at[cube, 0].set(friction)
        return fields | {"geom_friction": changed}

    def start(
        self, key: PRNGKeyArray, plant: Plant, world: PerWorldState
    ) -> tuple[PhysicsState, Float[Array, " joints"]]:
        """The stance with noise at a random heading ψ, the cube before it.

        The cube is at p_o = p + d (cos(ψ + β), sin(ψ + β)), with d and β drawn.

        Returns:
            The state, and the joint targets of the stance [rad].

        Source:
            Ours.
        """
        del world
        config = self.config
        state = near_stance(key, plant, config.reset_joint_rad, config.reset_speed_mps)
        ahead = heading(state.qpos[3:7], self._q_off)
        ends = (config.object_m, config.object_bearing_deg)
        way, _ = _way(key, "object", ahead, *ends)
        state = place_cube(key, state, state.qpos[:2] + way)
        return state, jnp.array(plant.stance.target_rad)

    def begin_episode(
        self, key: PRNGKeyArray, world: PerWorldState, state: PhysicsState
    ) -> dict[str, Any]:
        """A target, a camera, and the first guidance."""
        del world
        config, qpos = self.config, state.qpos
        ahead = heading(qpos[3:7], self._q_off)
        ends = (config.target_m, config.target_bearing_deg)
        way, distance = _way(key, "target", ahead, *ends)
        target_w = qpos[POS][:2] + way
        truth = self._truth(jnp.zeros(()), qpos)
        camera = start_camera(stream(key, "camera"), config.camera, truth)
        track = start_track(read_camera(camera))
        task = PushMemory(target_w, distance, distance, camera, track)
        command = guidance(qpos, target_w, self._q_off)
        return {"command": command, "task": task} | self.begin_gait()

    def inputs(
        self, carried: Mapping[str, Any], sample: Sample
    ) -> dict[str, Float[Array, " n"]]:
        """What the tracker makes of the camera's samples, in V; see `track_inputs`.

        In V: e = p_o − p, v = (p_o − s)/τ and e_g = g − p_o.

        Returns:
            `object_pos` [m], `object_vel` [m/s], `object_to_target` [m].

        Source:
            Paper, object pushing; the velocity filter is ours.
        """
        task = carried["task"]
        target_w = jnp.append(task.target_w, HALF_M)
        gravity_v = unrotate(self._q_off, sample.gravity)
        return track_inputs(task.track, target_w, gravity_v)

    def scene_signals(
        self,
        plant: Plant,
        carried: Mapping[str, Any],
        signals: Signals,
        output: PhysicsOutput,
    ) -> dict[str, Shaped[Array, "..."]]:
        """Cube and target: positions, velocity, distance d = ‖g − p_o‖, progress; load.

        Returns:
            Positions and distances [m], `object_vel_w` [m/s]. `progress_mps` is −Δd/Δt,
            the decrease over the control step [m/s]; `fallen` is 1 where the episode
            ends by a fall; with those of `load_signals`.

        Source:
            Paper, object pushing.
        """
        task, qpos = carried["task"], output.state.qpos
        load = load_signals(plant, carried, signals, self.config.action_scale_rad)
        error = safe_norm(task.target_w - qpos[POS][:2])
        return {
            "object_pos_w": qpos[POS],
            "object_vel_w": output.state.qvel[VEL],
            "target_w": task.target_w,
            "target_distance_m": task.distance_m,
            "target_error_m": error,
            "progress_mps": (task.error_m - error) / self.config.control_dt_s,
            "pocket_to_object_m": cube_v(qpos, self._q_off) - jnp.array(POCKET_V),
            "fallen": fallen(signals, self.config).astype(jnp.float32),
            **load,
        }

    def privileged(
        self, carried: Mapping[str, Any], signals: Signals
    ) -> Float[Array, "12"]:
        """Cube and target in V as they are, x_V = V* ⊗ x_w ⊗ V, and the guidance.

        Returns:
            Cube [m], its velocity [m/s], way to the target [m], command
            [m/s, m/s, rad/s].

        Source:
            Ours.
        """
        extra = signals.extra
        v_quat = multiply(signals.palm_quat_w, self._q_off)
        pos_w = extra["object_pos_w"]
        to_target_w = jnp.append(extra["target_w"], HALF_M) - pos_w
        vectors = (pos_w - signals.palm_pos_w, extra["object_vel_w"], to_target_w)
        parts = [unrotate(v_quat, vector) for vector in vectors]
        return jnp.concatenate([*parts, carried["command"]])

    def advance(self, memory: Memory, signals: Signals) -> Memory:
        """The next camera sample, the tracker's and the guide's answer to the state."""
        task, extra = memory.task, signals.extra
        key = memory.world.step_key("camera")
        now_s = memory.steps * self.config.control_dt_s
        qpos = jnp.concatenate(
            [signals.palm_pos_w, signals.palm_quat_w, signals.joint_pos]
        )
        # As in the scene, where the cube's orientation follows; it is not used.
        qpos = jnp.concatenate([qpos, extra["object_pos_w"], jnp.zeros(4)])
        camera = step_camera(
            key, self.config.camera, task.camera, self._truth(now_s, qpos)
        )
        track = step_track(task.track, read_camera(camera))
        task = task.replace(error_m=extra["target_error_m"], camera=camera, track=track)
        command = guidance(qpos, task.target_w, self._q_off)
        return memory.replace(command=command, task=task)

    def measures(self, signals: Signals) -> dict[str, Float[Array, ""]]:
        """Distance d = ‖g − p_o‖ of the cube [m], and whether d < 2 cm [1].

        Source:
            Paper, object pushing (delivery).
        """
        error_m = signals.extra["target_error_m"]
        return {"target_error_m": error_m, "at_target": object_delivered(error_m)}

    def episode_measures(
        self, recorded: Mapping[str, Shaped[Array, "T ..."]], counts: Bool[Array, " T"]
    ) -> dict[str, Float[Array, ""]]:
        """Delivery, d ∈ [0, 2 cm) and then [0, 5 cm) for 1 s; see `push_measures`.

        Returns:
            Flags [1], times [s] and distances [m]; `stopped`, see `load.stopped` [1].

        Source:
            Paper, object pushing.
        """
        dt_s = self.config.control_dt_s
        pressed = (recorded["effort_share"], recorded["joint_lag_rad"])
        way = (recorded["target_error_m"], recorded["target_distance_m"])
        return push_measures(*way, counts, dt_s) | {
            "stopped": stopped(*pressed, counts, dt_s)
        }

    def _truth(self, now_s: Float[Array, ""], qpos: Float[Array, " nq"]) -> Frame:
        """What there is to see."""
        return Frame(now_s, qpos[POS], qpos[:3], heading(qpos[3:7], self._q_off))

    @property
    def _q_off(self) -> Float[Array, "4"]:
        return jnp.array(self.stance.q_off)


def _uniform(key: PRNGKeyArray, name: str, ends: Range) -> Float[Array, ""]:
    return jax.random.uniform(stream(key, name), (), minval=ends[0], maxval=ends[1])


def _way(
    key: PRNGKeyArray,
    name: str,
    ahead_rad: Float[Array, ""],
    lengths_m: Range,
    bearings_deg: Range,
) -> tuple[Float[Array, "2"], Float[Array, ""]]:
    """A drawn way on the floor, off the direction ahead, and its length [m]."""
    angle = ahead_rad + jnp.deg2rad(_uniform(key, f"{name}_bearing", bearings_deg))
    length = _uniform(key, name, lengths_m)
    return length * jnp.stack([jnp.cos(angle), jnp.sin(angle)]), length
