"""Keyboard pressing: press the requested arrow key while four fingertips stand."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import flax.struct
import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from jaxtyping import Array, Bool, Float

from envs.env import HandEnv
from envs.errors import InputError
from envs.hand.hand_file import HandFile, load_hand_file
from envs.hand.spec import HAND_NQ, JOINT_QPOS, TIP_LINKS
from envs.hand.stance import Stance
from envs.memory import Memory, PerWorldState
from envs.observations import InputTerm, Sample
from envs.physics import ModelFields, PhysicsOutput, PhysicsState
from envs.plant import Plant
from envs.rotations import about_z, multiply, rotate, unrotate
from envs.scoring import check_weights
from envs.settings import HandSettings
from envs.signals import Signals
from envs.streams import stream
from envs.tasks.keyboard.fingertip import TIP_RADIUS_M, fingertip_v
from envs.tasks.keyboard.measures import press_measures
from envs.tasks.keyboard.model import (
    ACTUATION_M,
    ARROWS,
    KEY_CENTRES_M,
    KEY_NAMES,
    TOP_M,
    add_keyboard,
    free_fingertip,
    key_events,
)
from envs.tasks.keyboard.requests import (
    IDLE,
    RequestConfig,
    Requests,
    begin_requests,
    check_requests,
    judge,
    next_request,
    one_hot,
)
from envs.tasks.keyboard.stance import (
    FINGER_INDEX,
    PLACEMENT,
    SUPPORTS,
    keyboard_stance,
)
from envs.tasks.keyboard.variation import (
    KeyboardDraw,
    KeyboardVariation,
    draw_keyboard,
    keyboard_fields,
)
from rewards import KEYBOARD, RewardTable, safe_norm, support_drift

PRESS_DEPTH_M = 0.001
"""How far below its actuation depth a press aims; ours."""

HOVER_M = 0.004
"""Gap between fingertip and keys while nothing is asked; ours."""

INPUTS = (
    InputTerm("request", len(ARROWS), "key", "1"),
    InputTerm("fingertip_pos", 3, "V", "m"),
)


@dataclass(frozen=True)
class KeyboardConfig(HandSettings):
    """Settings of keyboard pressing; the common ones are those of `HandSettings`.

    Attributes:
        max_roll_deg, max_pitch_deg: tilt of V that is a loss of stance (ours; those of
            crawling).
        max_drift_m: mean displacement of the supporting tips that is one (ours).
        reset_joint_rad: largest joint offset at reset (ours).
        requests: when keys are asked for.
        keyboard: what differs from keyboard to keyboard.
    """

    action_scale_rad: float = field(default=0.028, metadata={"unit": "rad", "low": 0.0})
    max_roll_deg: float = field(default=35.0, metadata={"unit": "deg", "low": 1.0})
    max_pitch_deg: float = field(default=30.0, metadata={"unit": "deg", "low": 1.0})
    max_drift_m: float = field(default=0.03, metadata={"unit": "m", "low": 1e-3})
    reset_joint_rad: float = field(default=0.02, metadata={"unit": "rad", "low": 0.0})
    requests: RequestConfig = field(default_factory=RequestConfig)
    keyboard: KeyboardVariation = field(default_factory=KeyboardVariation)
    # Warp's pool also holds pairs of links and keys that are only near each other.
    contacts_per_world: int = field(default=96, metadata={"low": 1, "free": True})

    def __post_init__(self) -> None:
        super().__post_init__()
        check_weights(KEYBOARD, self.weights)
        check_requests(self.requests, self.control_dt_s)


@flax.struct.dataclass
class KeyboardMemory:
    """What an episode carries.

    Attributes:
        requests: the request under way.
        down: the keys that are closed.
        support_start_w: where the supporting tips stood [m] (4 × 2).
    """

    requests: Requests
    down: Bool[Array, "*b keys"]
    support_start_w: Float[Array, "*b tips 2"]


@dataclass(frozen=True)
class Keyboard:
    """Keyboard pressing as `envs.task.HandTask`.

    Attributes:
        config: settings of the task.
        stance: the stance before the keyboard.
        table: rows of the reward; they may bind every signal, those of
            `scene_signals` and the magnitudes of `magnitudes`.
        input_terms: what the policy is told besides the common terms (paper).
    """

    config: KeyboardConfig
    stance: Stance
    table: RewardTable = KEYBOARD
    input_terms: tuple[InputTerm, ...] = INPUTS

    def add_scene(self, spec: mujoco.MjSpec) -> None:
        """The keyboard."""
        add_keyboard(spec, PLACEMENT, TIP_LINKS[FINGER_INDEX])
        free_fingertip(spec, TIP_LINKS[FINGER_INDEX])

    def vary_scene(
        self, plant: Plant, fields: ModelFields, world: PerWorldState
    ) -> ModelFields:
        """The world's own keys, and how high they are."""
        return keyboard_fields(plant.mj_model, fields, self._draw(world))

    def begin_world(self) -> dict[str, Any]:
        """Nothing that the world's random key does not give."""
        return {}

    def start(
        self, key: Array, plant: Plant, world: PerWorldState
    ) -> tuple[PhysicsState, Float[Array, "20"]]:
        """The stance with noise, before a keyboard that is not quite aligned.

        The keyboard stays where it is in the world. The hand is turned about Down and
        shifted, by what the keyboard would be turned and shifted against the hand.
        """
        del world
        variation, rest = self.config.keyboard, plant.rest.state
        turn, shift = _misalignment(key, variation)
        down_w = jnp.array([PLACEMENT.x_w, PLACEMENT.y_w, 0.0])
        root = rotate(about_z(turn), rest.qpos[:3] - down_w) + down_w
        bound = self.config.reset_joint_rad
        joints = rest.qpos[JOINT_QPOS] + jax.random.uniform(
            stream(key, "joints"), (20,), minval=-bound, maxval=bound
        )
        qpos = (
            rest.qpos.at[:3]
            .set(root.at[:2].add(shift))
            .at[3:7]
            .set(multiply(about_z(turn), rest.qpos[3:7]))
            .at[JOINT_QPOS]
            .set(jnp.clip(joints, plant.joint_range[:, 0], plant.joint_range[:, 1]))
        )
        zero = jnp.zeros(plant.mj_model.nv)
        return PhysicsState(qpos, zero, zero), jnp.array(self.stance.target_rad)

    def begin_episode(
        self, key: Array, world: PerWorldState, state: PhysicsState
    ) -> dict[str, Any]:
        """A gap before the first request; all keys up."""
        del world
        requests = begin_requests(key, self.config.requests, self.config.control_dt_s)
        v_quat_w = multiply(state.qpos[3:7], jnp.array(self.stance.q_off))
        feet_v = jnp.array(self.stance.footprint_v)[jnp.array(SUPPORTS)]
        feet_w = state.qpos[:3] + jax.vmap(lambda p: rotate(v_quat_w, p))(feet_v)
        down = jnp.zeros(len(KEY_NAMES), bool)
        memory = KeyboardMemory(requests, down, feet_w[:, :2])
        return {"command": jnp.zeros(3), "task": memory}

    def inputs(self, carried: Mapping[str, Any], told: Sample) -> dict[str, Array]:
        """The request, and the pressing fingertip as the encoders tell it (paper)."""
        joint_pos = told.joint_pos + jnp.array(self.stance.joint_pos_rad)
        return {
            "request": one_hot(carried["task"].requests),
            "fingertip_pos": fingertip_v(joint_pos, jnp.array(self.stance.q_off)),
        }

    def scene_signals(
        self,
        plant: Plant,
        carried: Mapping[str, Any],
        signals: Signals,
        output: PhysicsOutput,
    ) -> dict[str, Array]:
        """Keys, fingertips in the world, and what became of the request.

        Returns:
            key_depth_m, key_actuation_m, key_down, key_pressed, key_touched: of the
            keys in the order of `KEY_NAMES`; `key_touched` tells of all parts of the
            hand but the pressing fingertip.
            requested: 1 at the requested key; asked, idle: whether there is a request.
            hit, wrong, timeout, latency_s, stray: see `Outcome`.
            arrow_offset_m: from the pressing tip to where it would press each arrow.
            goal_offset_m: the same for the requested one; hover_offset_m: to the place
            between requests.
            support_pos_w, support_start_w, support_vel_w, support_force_n: of the
            other tips. drift_m, tilt_deg, gravity_v, stance_lost: of the stance.
        """
        memory: KeyboardMemory = carried["task"]
        draw = self._draw(carried["world"])
        depth_m = output.state.qpos[HAND_NQ : HAND_NQ + len(KEY_NAMES)]
        down, pressed = key_events(memory.down, depth_m, draw.actuation_m)
        requests, config = memory.requests, self.config
        outcome = judge(requests, pressed, config.requests, config.control_dt_s)
        asked = (requests.key != IDLE).astype(jnp.float32)
        requested = (jnp.arange(len(KEY_NAMES)) == requests.key).astype(jnp.float32)
        return {
            "key_depth_m": depth_m,
            "key_actuation_m": draw.actuation_m,
            "key_down": down,
            "key_pressed": pressed.astype(jnp.float32),
            "key_touched": _touched_by_others(plant, output),
            "requested": requested,
            "asked": asked,
            "idle": 1.0 - asked,
            **vars(outcome),
            **self._tip_signals(signals, draw, requested),
            **self._stance_signals(signals, memory),
        }

    def privileged(
        self, carried: Mapping[str, Any], signals: Signals
    ) -> Float[Array, " n"]:
        """Where the keys are, how they resist, how long the request waits.

        Their depth is not in it: most keys never move at first, and the normalizer
        would make their first press a huge number. Where the tip stands tells it.
        """
        memory: KeyboardMemory = carried["task"]
        draw = self._draw(carried["world"])
        v_quat_w = multiply(signals.palm_quat_w, jnp.array(self.stance.q_off))
        offsets = jax.vmap(lambda x: unrotate(v_quat_w, x))(
            signals.extra["arrow_offset_m"]
        )
        waiting_s = memory.requests.steps * self.config.control_dt_s
        drift = signals.extra["support_pos_w"] - memory.support_start_w
        parts = (offsets, drift, draw.actuation_m, draw.force_n)
        flat = [x.reshape(-1) for x in parts]
        return jnp.concatenate([*flat, waiting_s[None]])

    def magnitudes(
        self, memory: Memory, signals: Signals, valid: Bool[Array, ""]
    ) -> tuple[Memory, dict[str, Array]]:
        """Nothing beyond the signals."""
        del signals, valid
        return memory, {}

    def terminated(self, signals: Signals) -> Bool[Array, ""]:
        """The stance is lost: palm contact, tilt, or the hand has slid away."""
        return signals.extra["stance_lost"] > 0

    def advance(self, memory: Memory, signals: Signals) -> Memory:
        """The keys' state, and the next request when this one is decided."""
        task, extra, world = memory.task, signals.extra, memory.world
        key = jax.random.fold_in(stream(world.key, "requests"), world.total_steps)
        key = jax.random.fold_in(key, world.episodes)
        ended = extra["hit"] + extra["wrong"] + extra["timeout"] > 0
        config, dt_s = self.config.requests, self.config.control_dt_s
        requests = next_request(key, task.requests, ended, config, dt_s)
        return memory.replace(
            task=task.replace(requests=requests, down=extra["key_down"])
        )

    def measures(self, signals: Signals) -> dict[str, Float[Array, ""]]:
        """Events of the step, and drift of the stance."""
        names = ("hit", "wrong", "timeout", "stray", "drift_m")
        return {name: signals.extra[name] for name in names}

    def episode_measures(
        self, recorded: Mapping[str, Array], counts: Bool[Array, " T"]
    ) -> dict[str, Float[Array, ""]]:
        """See `envs.tasks.keyboard.measures`."""
        return press_measures(recorded, counts)

    def _draw(self, world: PerWorldState) -> KeyboardDraw:
        return draw_keyboard(world.key, self.config.keyboard)

    def _tip_signals(
        self, signals: Signals, draw: KeyboardDraw, requested: Float[Array, " keys"]
    ) -> dict[str, Array]:
        """From the pressing fingertip to its goals [m, world]."""
        tip_w = self._tips_w(signals)[FINGER_INDEX]
        arrows = PLACEMENT.to_world(KEY_CENTRES_M[: len(ARROWS)])
        height = TOP_M + TIP_RADIUS_M - ACTUATION_M - PRESS_DEPTH_M + draw.height_m
        goals_w = jnp.concatenate(
            [jnp.array(arrows), jnp.full((len(ARROWS), 1), height)], axis=1
        )
        offsets = goals_w - tip_w
        tip = np.array(self.stance.footprint_v[FINGER_INDEX])
        hover_w = jnp.array([tip[0], tip[1], TOP_M + TIP_RADIUS_M + HOVER_M])
        return {
            "arrow_offset_m": offsets,
            "goal_offset_m": requested[: len(ARROWS)] @ offsets,
            "hover_offset_m": hover_w - tip_w,
        }

    def _stance_signals(
        self, signals: Signals, memory: KeyboardMemory
    ) -> dict[str, Array]:
        """The supporting fingertips, and whether the hand still stands."""
        others, config = jnp.array(SUPPORTS), self.config
        feet_w = self._tips_w(signals)[others, :2]
        drift_m = support_drift(feet_w, memory.support_start_w)
        gravity_v = unrotate(jnp.array(self.stance.q_off), signals.gravity_b)
        limits = jnp.deg2rad(jnp.array([config.max_roll_deg, config.max_pitch_deg]))
        fallen = jnp.any(jnp.abs(signals.tilt_rad) > limits)
        lost = fallen | (signals.palm_contact > 0) | (drift_m > config.max_drift_m)
        tilt = jnp.arctan2(safe_norm(gravity_v[:2]), -gravity_v[2])
        return {
            "support_pos_w": feet_w,
            "support_start_w": memory.support_start_w,
            "support_vel_w": signals.tip_vel_w[others],
            "support_force_n": signals.tip_force_n[others],
            "drift_m": drift_m,
            "gravity_v": gravity_v,
            "tilt_deg": jnp.rad2deg(tilt),
            "stance_lost": lost.astype(jnp.float32),
        }

    def _tips_w(self, signals: Signals) -> Float[Array, "5 3"]:
        v_quat_w = multiply(signals.palm_quat_w, jnp.array(self.stance.q_off))
        turned = jax.vmap(lambda p: rotate(v_quat_w, p))(signals.tip_pos_v)
        return signals.palm_pos_w + turned


class KeyboardEnv(HandEnv):
    """One world of keyboard pressing; the caller vmaps it.

    Args:
        config: settings of the task.
        backend, num_worlds, hand, stance: see `envs.env.HandEnv`; the stance is
            the one before the keyboard if not given.
    """

    def __init__(
        self,
        config: KeyboardConfig | None = None,
        backend: str = "cpu",
        num_worlds: int = 1,
        hand: HandFile | None = None,
        stance: Stance | None = None,
    ):
        hand = hand or load_hand_file()
        if hand.figures:
            valid = "none: the task's fingertip is told by the vendor's figures"
            raise InputError("hand file", "figures", "figures of a hand", valid)
        stance = stance or keyboard_stance(hand)
        task = Keyboard(config or KeyboardConfig(), stance)
        super().__init__(task, backend, num_worlds, hand, stance)


def _misalignment(
    key: Array, variation: KeyboardVariation
) -> tuple[Float[Array, ""], Float[Array, "2"]]:
    """Turn [rad] and shift [m] of the hand against its place before the keyboard."""
    bound_rad, bound_m = jnp.deg2rad(variation.align_deg), variation.align_m
    turn = jax.random.uniform(stream(key, "turn"), (), minval=-1.0)
    shift = jax.random.uniform(stream(key, "shift"), (2,), minval=-1.0)
    return bound_rad * turn, bound_m * shift


def _touched_by_others(plant: Plant, output: PhysicsOutput) -> Bool[Array, " keys"]:
    """Whether a key has more contacts than those with the pressing fingertip."""

    def count(kind: str) -> Float[Array, " keys"]:
        names = [f"{kind}_{name}" for name in KEY_NAMES]
        read = [plant.spec.read(output.sensordata, name)[0] for name in names]
        return jnp.stack(read)

    return count("touch") > count("finger") + 0.5
