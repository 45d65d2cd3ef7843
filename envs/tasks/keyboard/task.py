"""Keyboard pressing: press the requested arrow key while four fingertips stand."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import flax.struct
import jax
import jax.numpy as jnp
import mujoco
from jaxtyping import Array, Bool, Float, PRNGKeyArray, Shaped

from envs.config.settings.keyboard import KeyboardConfig
from envs.hand.hand_file import HandFile
from envs.hand.nominal import vendor_hand
from envs.hand.stance import Stance
from envs.memory import Memory, PerWorldState
from envs.observations import InputTerm, Sample
from envs.physics.base import ModelFields, PhysicsOutput, PhysicsState
from envs.plant import Plant
from envs.rotations import about_z, multiply, rotate, unrotate
from envs.signals import Signals
from envs.task import HandTask
from envs.tasks.keyboard.measures import press_measures
from envs.tasks.keyboard.model import (
    ARROWS,
    KEY_NAMES,
    add_keyboard,
    free_fingertip,
    key_events,
)
from envs.tasks.keyboard.requests import (
    IDLE,
    Requests,
    begin_requests,
    judge,
    next_request,
    one_hot,
)
from envs.tasks.keyboard.signals import (
    goal_offsets,
    support_signals,
    touched_by_others,
)
from envs.tasks.keyboard.stance import FINGER_INDEX, PLACEMENT, SUPPORTS, fingertip_v
from envs.tasks.keyboard.variation import (
    KeyboardDraw,
    draw_keyboard,
    keyboard_fields,
    misalignment,
)
from envs.tasks.upright import near_joints
from rewards import KEYBOARD, RewardTable


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
class Keyboard(HandTask):
    """Keyboard pressing as `envs.task.HandTask`.

    Attributes:
        config: settings of the task.
        stance: the stance before the keyboard.
        table: rows of the reward; they may bind every signal, those of
            `scene_signals` and the magnitudes of `magnitudes`.
    """

    config: KeyboardConfig
    stance: Stance
    table: RewardTable = KEYBOARD

    @classmethod
    def on(cls, config: KeyboardConfig, hand: HandFile, stance: Stance) -> "Keyboard":
        """The task for a hand in its stance before the keyboard."""
        del hand
        return cls(config, stance)

    @property
    def input_terms(self) -> tuple[InputTerm, ...]:
        """The request and the pressing fingertip (paper)."""
        request = InputTerm("request", len(ARROWS), "key", "1")
        return (request, InputTerm("fingertip_pos", 3, "V", "m"))

    def add_scene(self, spec: mujoco.MjSpec) -> None:
        """The keyboard."""
        tip = vendor_hand().tip_links[FINGER_INDEX].body
        add_keyboard(spec, PLACEMENT, tip)
        free_fingertip(spec, tip)

    def vary_scene(
        self, plant: Plant, fields: ModelFields, world: PerWorldState
    ) -> ModelFields:
        """The world's own keys, and how high they are."""
        return keyboard_fields(plant.mj_model, fields, self._draw(world))

    def start(
        self, key: PRNGKeyArray, plant: Plant, world: PerWorldState
    ) -> tuple[PhysicsState, Float[Array, " joints"]]:
        """The stance with noise, before a keyboard that is not quite aligned.

        The keyboard stays where it is in the world. The hand is turned by ψ about Down,
        d, and shifted by s, by what the keyboard would be turned and shifted against
        the hand: p = R(ψ)(p* − d) + d + s.

        Returns:
            The state at rest, and the joint targets of the stance [rad].

        Source:
            Paper, keyboard pressing (the operator aligns the keyboard); noise is ours.
        """
        del world
        turn, shift = misalignment(key, self.config.keyboard)
        rest = plant.rest.state
        down_w = jnp.array([PLACEMENT.x_w, PLACEMENT.y_w, 0.0])
        root = rotate(about_z(turn), rest.qpos[:3] - down_w) + down_w
        qpos = (
            rest.qpos.at[:3]
            .set(root.at[:2].add(shift))
            .at[3:7]
            .set(multiply(about_z(turn), rest.qpos[3:7]))
            .at[plant.spec.joint_qpos]
            .set(near_joints(key, plant, self.config.reset_joint_rad))
        )
        zero = jnp.zeros(plant.mj_model.nv)
        return PhysicsState(qpos, zero, zero), jnp.array(self.stance.target_rad)

    def begin_episode(
        self, key: PRNGKeyArray, world: PerWorldState, state: PhysicsState
    ) -> dict[str, Any]:
        """A gap before the first request; all keys up."""
        del world
        requests = begin_requests(key, self.config.requests, self.config.control_dt_s)
        feet_v = jnp.array(self.stance.footprint_v)[jnp.array(SUPPORTS)]
        feet_w = self._to_world(state.qpos[:3], state.qpos[3:7], feet_v)
        down = jnp.zeros(len(KEY_NAMES), bool)
        memory = KeyboardMemory(requests, down, feet_w[:, :2])
        return {"command": jnp.zeros(3), "task": memory}

    def inputs(
        self, carried: Mapping[str, Any], sample: Sample
    ) -> dict[str, Float[Array, " n"]]:
        """The request r and the pressing fingertip p = FK(θ) by the encoders' angles θ.

        Returns:
            `request` [1], `fingertip_pos` in V [m].

        Source:
            Paper, keyboard pressing.
        """
        joint_pos = sample.joint_pos + jnp.array(self.stance.joint_pos_rad)
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
    ) -> dict[str, Shaped[Array, "..."]]:
        """Keys, fingertips in the world, and the outcome of the request, s = h(x).

        Returns:
            key_depth_m, key_actuation_m [m], key_down, key_pressed, key_touched [1]: of
            the keys in the order of `KEY_NAMES`; `key_touched` by all parts of the hand
            but the pressing fingertip.
            requested: 1 at the requested key; asked, idle: whether there is a request.
            hit, wrong, timeout, latency_s, stray: see `Outcome`.
            arrow_offset_m, goal_offset_m, hover_offset_m [m]: see `goal_offsets`.
            support_pos_w, _start_w, _vel_w, _force_n, _shear_n: of the other tips.
            drift_m, tilt_deg, gravity_v, stance_lost: of the stance.

        Source:
            Paper, keyboard pressing; the loss of stance is ours.
        """
        memory, draw = carried["task"], self._draw(carried["world"])
        depth_m = output.state.qpos[plant.spec.nq :][: len(KEY_NAMES)]
        down, pressed = key_events(memory.down, depth_m, draw.actuation_m)
        requests, config = memory.requests, self.config
        outcome = judge(requests, pressed, config.requests, config.control_dt_s)
        asked = (requests.key != IDLE).astype(jnp.float32)
        requested = (jnp.arange(len(KEY_NAMES)) == requests.key).astype(jnp.float32)
        pose = (signals.palm_pos_w, signals.palm_quat_w)
        tips_w = self._to_world(*pose, signals.tip_pos_v)
        hover_w = jnp.array(self.stance.footprint_v[FINGER_INDEX][:2])
        return {
            "key_depth_m": depth_m,
            "key_actuation_m": draw.actuation_m,
            "key_down": down,
            "key_pressed": pressed.astype(jnp.float32),
            "key_touched": touched_by_others(plant, output),
            "requested": requested,
            "asked": asked,
            "idle": 1.0 - asked,
            **vars(outcome),
            **goal_offsets(tips_w[FINGER_INDEX], hover_w, draw.height_m, requested),
            **support_signals(
                signals, tips_w, memory.support_start_w, self.stance, config
            ),
        }

    def privileged(
        self, carried: Mapping[str, Any], signals: Signals
    ) -> Float[Array, " n"]:
        """Where the keys are, how they resist, how long the request waits, t = n Δt.

        Their depth is not in it: most keys never move at first, and the normalizer
        would make their first press a huge number. It follows from where the tip is.

        Returns:
            Offsets of the arrows in V, drift of the supports and actuation depths [m],
            operating forces [N], waiting time [s].

        Source:
            Ours.
        """
        memory, draw = carried["task"], self._draw(carried["world"])
        quat, arrows = self._v_quat_w(signals.palm_quat_w), "arrow_offset_m"
        offsets = jax.vmap(lambda x: unrotate(quat, x))(signals.extra[arrows])
        waiting_s = memory.requests.steps * self.config.control_dt_s
        drift = signals.extra["support_pos_w"] - memory.support_start_w
        parts = (offsets, drift, draw.actuation_m, draw.force_n)
        flat = [x.reshape(-1) for x in parts]
        return jnp.concatenate([*flat, waiting_s[None]])

    def terminated(self, signals: Signals) -> Bool[Array, ""]:
        """The stance is lost, end = palm contact ∨ tilt ∨ drift d > d_max.

        Returns:
            One flag [1].

        Source:
            Paper, keyboard pressing (loss of stance); the limits are ours.
        """
        return signals.extra["stance_lost"] > 0

    def advance(self, memory: Memory, signals: Signals) -> Memory:
        """The keys' state, and the next request when this one is decided."""
        task, extra = memory.task, signals.extra
        key = memory.world.step_key("requests")
        ended = extra["hit"] + extra["wrong"] + extra["timeout"] > 0
        config, dt_s = self.config.requests, self.config.control_dt_s
        requests = next_request(key, task.requests, ended, config, dt_s)
        return memory.replace(
            task=task.replace(requests=requests, down=extra["key_down"])
        )

    def measures(self, signals: Signals) -> dict[str, Float[Array, ""]]:
        """Events of the step [1], and drift of the stance [m], m = h(s).

        Source:
            Paper, keyboard pressing (recorded outcomes); the drift is ours.
        """
        names = ("hit", "wrong", "timeout", "stray", "drift_m")
        return {name: signals.extra[name] for name in names}

    def episode_measures(
        self, recorded: Mapping[str, Shaped[Array, "T ..."]], counts: Bool[Array, " T"]
    ) -> dict[str, Float[Array, ""]]:
        """Outcomes of the requests, see `press_measures`: correct = hits/decided.

        Returns:
            Fractions and counts [1], latencies [s], tilt [°], drift [mm].

        Source:
            Paper, keyboard pressing.
        """
        return press_measures(recorded, counts)

    def _draw(self, world: PerWorldState) -> KeyboardDraw:
        return draw_keyboard(world.key, self.config.keyboard)

    def _v_quat_w(self, palm_quat_w: Float[Array, "4"]) -> Float[Array, "4"]:
        return multiply(palm_quat_w, jnp.array(self.stance.q_off))

    def _to_world(
        self,
        palm_pos_w: Float[Array, "3"],
        palm_quat_w: Float[Array, "4"],
        points_v: Float[Array, "n 3"],
    ) -> Float[Array, "n 3"]:
        """Points relative to the palm in V as points in the world."""
        quat = self._v_quat_w(palm_quat_w)
        return palm_pos_w + jax.vmap(lambda p: rotate(quat, p))(points_v)
