"""Object pushing: walk to a cube and push it to a target that is fixed in the world."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import flax.struct
import jax
import jax.numpy as jnp
import mujoco
from jaxtyping import Array, Bool, Float

from envs.env import HandEnv
from envs.errors import check_ordered
from envs.hand.hand_file import HandFile, load_hand_file
from envs.hand.stance import Stance, stance_of
from envs.memory import Memory, PerWorldState
from envs.observations import InputTerm, Sample
from envs.physics import ModelFields, PhysicsOutput, PhysicsState
from envs.plant import Plant
from envs.rotations import multiply, rotate, unrotate
from envs.scoring import check_weights
from envs.settings import HandSettings
from envs.signals import Signals
from envs.streams import stream
from envs.task import BareTask
from envs.tasks.gait import fallen, step_gait
from envs.tasks.push.camera import (
    CameraConfig,
    CameraState,
    Frame,
    read_camera,
    start_camera,
    step_camera,
)
from envs.tasks.push.guide import POCKET_V, guide
from envs.tasks.push.measures import push_measures
from envs.tasks.push.scene import CUBE, HALF_M, POS, VEL, add_cube, place_cube
from envs.tasks.push.tracking import Track, start_track, step_track, track_inputs
from envs.tasks.start import near_stance
from rewards import (
    PUSH,
    RewardTable,
    init_footprint_memory,
    init_lift_memory,
    safe_norm,
)

Range = tuple[float, float]
INPUTS = (
    InputTerm("object_pos", 3, "V", "m"),
    InputTerm("object_vel", 3, "V", "m/s"),
    InputTerm("object_to_target", 3, "V", "m"),
)


@dataclass(frozen=True)
class PushConfig(HandSettings):
    """Settings of object pushing; the common ones are those of `HandSettings`.

    Attributes:
        target_m: distance of the target from the cube (paper).
        target_bearing_deg: direction of the target, seen from the cube, against the
            hand's heading at the start (ours).
        object_m: distance of the cube from the palm's origin at the start (ours).
        object_bearing_deg: direction of the cube against the hand's heading (ours).
        object_friction: of the cube on the floor (ours).
        max_roll_deg, max_pitch_deg: tilt of V that ends the episode, as in crawling.
        reset_joint_rad: largest joint offset at reset (ours).
        reset_speed_mps: largest base speed at reset, each axis (ours).
        camera: what the camera does to positions.
    """

    action_scale_rad: float = field(default=0.040, metadata={"unit": "rad", "low": 0.0})
    target_m: Range = field(default=(0.10, 0.40), metadata={"unit": "m", "low": 0.0})
    target_bearing_deg: Range = field(default=(-40.0, 40.0), metadata={"unit": "deg"})
    object_m: Range = field(default=(0.17, 0.26), metadata={"unit": "m", "low": 0.0})
    object_bearing_deg: Range = field(default=(-20.0, 20.0), metadata={"unit": "deg"})
    object_friction: Range = field(
        default=(0.2, 0.5), metadata={"unit": "1", "low": 0.0}
    )
    max_roll_deg: float = field(default=35.0, metadata={"unit": "deg", "low": 1.0})
    max_pitch_deg: float = field(default=30.0, metadata={"unit": "deg", "low": 1.0})
    reset_joint_rad: float = field(default=0.05, metadata={"unit": "rad", "low": 0.0})
    reset_speed_mps: float = field(default=0.05, metadata={"unit": "m/s", "low": 0.0})
    camera: CameraConfig = field(default_factory=CameraConfig)
    # The cube stands on four contacts and lies near all fingers.
    contacts_per_world: int = field(default=96, metadata={"low": 1, "free": True})
    constraints_per_world: int = field(default=224, metadata={"low": 1, "free": True})

    def __post_init__(self) -> None:
        super().__post_init__()
        check_weights(PUSH, self.weights)
        check_ordered(self, "target_m", "target_bearing_deg", "object_friction")
        check_ordered(self, "object_m", "object_bearing_deg")


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
class Push(BareTask):
    """Object pushing as `envs.task.HandTask`.

    Attributes:
        config: settings of the task.
        stance: settled stance of the hand, which defines V.
        table: rows of the reward.
    """

    config: PushConfig
    stance: Stance
    table: RewardTable = PUSH

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

    def begin_world(self) -> dict[str, Any]:
        """No footprint yet: it is captured in the first step and then kept."""
        return {"footprint": init_footprint_memory()}

    def start(
        self, key: Array, plant: Plant, world: PerWorldState
    ) -> tuple[PhysicsState, Float[Array, "20"]]:
        """The stance with noise at a random heading, the cube before it."""
        del world
        config = self.config
        state = near_stance(key, plant, config.reset_joint_rad, config.reset_speed_mps)
        bearing = _uniform(key, "object_bearing", config.object_bearing_deg)
        angle = self._heading(state.qpos[3:7]) + jnp.deg2rad(bearing)
        distance = _uniform(key, "object", config.object_m)
        state = place_cube(key, state, state.qpos[:2] + distance * _direction(angle))
        return state, jnp.array(plant.stance.target_rad)

    def begin_episode(
        self, key: Array, world: PerWorldState, state: PhysicsState
    ) -> dict[str, Any]:
        """A target, a camera, and the first guidance."""
        del world
        config, qpos = self.config, state.qpos
        bearing = _uniform(key, "target_bearing", config.target_bearing_deg)
        angle = self._heading(qpos[3:7]) + jnp.deg2rad(bearing)
        distance = _uniform(key, "target", config.target_m)
        target_w = qpos[POS][:2] + distance * _direction(angle)
        truth = self._truth(jnp.zeros(()), qpos)
        camera = start_camera(stream(key, "camera"), config.camera, truth)
        track = start_track(read_camera(camera))
        task = PushMemory(target_w, distance, distance, camera, track)
        command = self._guide(qpos, target_w)
        return {"command": command, "lift": init_lift_memory(), "task": task}

    def inputs(self, carried: Mapping[str, Any], told: Sample) -> dict[str, Array]:
        """What the tracker makes of the camera's samples, in V."""
        task = carried["task"]
        target_w = jnp.append(task.target_w, HALF_M)
        gravity_v = unrotate(jnp.array(self.stance.q_off), told.gravity)
        return track_inputs(task.track, target_w, gravity_v)

    def scene_signals(
        self,
        plant: Plant,
        carried: Mapping[str, Any],
        signals: Signals,
        output: PhysicsOutput,
    ) -> dict[str, Array]:
        """Cube and target: positions [m], velocity [m/s], distance and progress.

        `progress_mps` is the decrease of the distance over the control step; `fallen`
        is 1 where the episode ends by a fall.
        """
        del plant
        task, qpos = carried["task"], output.state.qpos
        error = safe_norm(task.target_w - qpos[POS][:2])
        return {
            "object_pos_w": qpos[POS],
            "object_vel_w": output.state.qvel[VEL],
            "target_w": task.target_w,
            "target_distance_m": task.distance_m,
            "target_error_m": error,
            "progress_mps": (task.error_m - error) / self.config.control_dt_s,
            "pocket_to_object_m": self._object_v(qpos) - jnp.array(POCKET_V),
            "fallen": fallen(signals, self.config).astype(jnp.float32),
        }

    def privileged(
        self, carried: Mapping[str, Any], signals: Signals
    ) -> Float[Array, "12"]:
        """Cube and target in V as they are, and the guidance."""
        extra = signals.extra
        v_quat = multiply(signals.palm_quat_w, jnp.array(self.stance.q_off))
        pos_w = extra["object_pos_w"]
        to_target_w = jnp.append(extra["target_w"], HALF_M) - pos_w
        vectors = (pos_w - signals.palm_pos_w, extra["object_vel_w"], to_target_w)
        parts = [unrotate(v_quat, vector) for vector in vectors]
        return jnp.concatenate([*parts, carried["command"]])

    def magnitudes(
        self, memory: Memory, signals: Signals, valid: Bool[Array, ""]
    ) -> tuple[Memory, dict[str, Array]]:
        """Steps the memories of the crawl's rewards."""
        return step_gait(memory, signals, valid, self.config.control_dt_s)

    def terminated(self, signals: Signals) -> Bool[Array, ""]:
        """Palm contact, or V tilted beyond the limits, as in crawling."""
        return fallen(signals, self.config)

    def advance(self, memory: Memory, signals: Signals) -> Memory:
        """The next camera sample, the tracker's and the guide's answer to the state."""
        task, world, extra = memory.task, memory.world, signals.extra
        key = jax.random.fold_in(stream(world.key, "camera"), world.total_steps)
        key = jax.random.fold_in(key, world.episodes)
        now_s = memory.steps * self.config.control_dt_s
        qpos = jnp.concatenate(
            [signals.palm_pos_w, signals.palm_quat_w, signals.joint_pos]
        )
        qpos = jnp.append(qpos, extra["object_pos_w"])
        camera = step_camera(
            key, self.config.camera, task.camera, self._truth(now_s, qpos)
        )
        track = step_track(task.track, read_camera(camera))
        task = task.replace(error_m=extra["target_error_m"], camera=camera, track=track)
        return memory.replace(command=self._guide(qpos, task.target_w), task=task)

    def measures(self, signals: Signals) -> dict[str, Float[Array, ""]]:
        """Distance of the cube from its target, and whether it is within 2 cm."""
        error_m = signals.extra["target_error_m"]
        return {
            "target_error_m": error_m,
            "at_target": (error_m < 0.02).astype(jnp.float32),
        }

    def episode_measures(
        self, recorded: Mapping[str, Array], counts: Bool[Array, " T"]
    ) -> dict[str, Float[Array, ""]]:
        """Delivery, see `envs.tasks.push.measures`."""
        return push_measures(
            recorded["target_error_m"],
            recorded["target_distance_m"],
            counts,
            self.config.control_dt_s,
        )

    def _truth(self, now_s: Float[Array, ""], qpos: Float[Array, " nq"]) -> Frame:
        """What there is to see."""
        return Frame(now_s, qpos[POS], qpos[:3], self._heading(qpos[3:7]))

    def _heading(self, palm_quat_w: Float[Array, "4"]) -> Float[Array, ""]:
        """Angle of V's x axis about the vertical."""
        v_quat_w = multiply(palm_quat_w, jnp.array(self.stance.q_off))
        x, y, _ = rotate(v_quat_w, jnp.array([1.0, 0.0, 0.0]))
        return jnp.arctan2(y, x)

    def _object_v(self, qpos: Float[Array, " nq"]) -> Float[Array, "2"]:
        """The cube relative to the palm, seen from above in the heading of V."""
        return _turned(qpos[POS][:2] - qpos[:2], -self._heading(qpos[3:7]))

    def _guide(
        self, qpos: Float[Array, " nq"], target_w: Float[Array, "2"]
    ) -> Float[Array, "3"]:
        to_target_w = target_w - qpos[POS][:2]
        to_target_v = _turned(to_target_w, -self._heading(qpos[3:7]))
        return guide(self._object_v(qpos), to_target_v)


class PushEnv(HandEnv):
    """One world of object pushing; the caller vmaps it.

    Args:
        config: settings of the task.
        backend, num_worlds, hand, stance: see `envs.env.HandEnv`.
    """

    def __init__(
        self,
        config: PushConfig | None = None,
        backend: str = "cpu",
        num_worlds: int = 1,
        hand: HandFile | None = None,
        stance: Stance | None = None,
    ):
        hand = hand or load_hand_file()
        stance = stance or stance_of(hand)
        task = Push(config or PushConfig(), stance)
        super().__init__(task, backend, num_worlds, hand, stance)


def _uniform(key: Array, name: str, ends: Range) -> Float[Array, ""]:
    return jax.random.uniform(stream(key, name), (), minval=ends[0], maxval=ends[1])


def _direction(angle_rad: Float[Array, ""]) -> Float[Array, "2"]:
    return jnp.stack([jnp.cos(angle_rad), jnp.sin(angle_rad)])


def _turned(vector: Float[Array, "2"], angle_rad: Float[Array, ""]) -> Array:
    cos, sin = jnp.cos(angle_rad), jnp.sin(angle_rad)
    x, y = vector
    return jnp.stack([cos * x - sin * y, sin * x + cos * y])
