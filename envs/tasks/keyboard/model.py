"""The keyboard: four arrow keys and their neighbours on springs, and its key events.

Keys are boxes on vertical slides. Their switch is CHERRY's linear MX: operating force
2.1 ± 0.7 oz (0.58 ± 0.19 N) at a pretravel of 2.0 ± 0.6 mm, total travel 4.0 mm (data
sheet "MX Series", CHERRY). The arrangement is that of a 75 % keyboard, in which Right
Shift, Up and End share a row and Enter lies behind them. Force at rest, moving mass,
damping, release depth, keycap and case are ours.
"""

from dataclasses import dataclass

import jax.numpy as jnp
import mujoco
import numpy as np
from jaxtyping import Array, Bool, Float

from envs.config.settings.keyboard import ACTUATION_M as ACTUATION_M
from envs.hand.model import PALM, PAYLOAD

PITCH_M = 0.01905
TRAVEL_M = 0.004
RELEASE_M = 0.0004
"""How far a pressed key must rise above its actuation depth to be released."""

FORCE_N = 0.58
REST_SHARE = 0.5
"""Force of a key at rest, as a share of that at its actuation depth."""

TOP_M = 0.030
"""Height of the keys' tops above the table."""

KEYBOARD = "keyboard"
_CASE_HEIGHT_M, _BEZEL_M = 0.018, 0.006
_CAP_M, _CAP_HEIGHT_M, _CAP_FRICTION = 0.0135, 0.008, 0.4
_MASS_KG, _ARMATURE_KG, _DAMPING = 0.002, 0.008, 1.0
_FLOOR_BIT, _HAND_BIT = 1, 2  # contact groups of `envs.hand.model`
_RIGID = {"solref": [0.01, 1.0], "solimp": [0.98, 0.99, 0.001, 0.5, 2.0]}


@dataclass(frozen=True)
class Key:
    """One key of the layout, in units of the key pitch.

    Attributes:
        name: of the key.
        right, away: its centre from that of Down.
        width: along the row.
    """

    name: str
    right: float
    away: float
    width: float = 1.0


LAYOUT = (
    Key("left", -1.0, 0.0),
    Key("down", 0.0, 0.0),
    Key("right", 1.0, 0.0),
    Key("up", 0.0, 1.0),
    Key("right_shift", -1.375, 1.0, 1.75),
    Key("right_ctrl", -2.0, 0.0),
    Key("end", 1.0, 1.0),
    Key("enter", -0.625, 2.0, 2.25),
)
"""The keys in the order of all vectors; the arrow keys come first."""

KEY_NAMES = tuple(key.name for key in LAYOUT)
ARROWS = KEY_NAMES[:4]
KEY_CENTRES_M = PITCH_M * np.array([(key.right, key.away) for key in LAYOUT])
"""Centres of the keys from that of Down, right and away from the typist [m] (8 × 2)."""


@dataclass(frozen=True)
class Placement:
    """Where the keyboard lies.

    Attributes:
        x_w, y_w: centre of Down [m].
        yaw_w: direction of the row's right end [rad], from world x.
    """

    x_w: float
    y_w: float
    yaw_w: float

    def to_world(self, points_m: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, "n 2"]:
        """Points on the keyboard as points on the table, p_w = R(yaw) p + (x, y).

        Args:
            points_m: right and away from Down's centre [m].

        Returns:
            x and y in the world [m].

        Source:
            Ours.
        """
        cos, sin = np.cos(self.yaw_w), np.sin(self.yaw_w)
        turned = points_m @ np.array([[cos, sin], [-sin, cos]])
        return turned + np.array([self.x_w, self.y_w])


def add_keyboard(spec: mujoco.MjSpec, placement: Placement, finger_geom: str) -> None:
    """Adds the keyboard to a scene, and sensors of who touches which key.

    Sensors `touch_<key>` count all contacts of a key, `finger_<key>` those with the
    pressing finger's tip. Palm and payload do not meet the keyboard: a hand that lies
    so low has lost its stance.

    Args:
        spec: scene with the hand.
        placement: where it lies.
        finger_geom: geom of the pressing fingertip.
    """
    yaw = placement.yaw_w / 2
    board = spec.worldbody.add_body(
        name=KEYBOARD,
        pos=[placement.x_w, placement.y_w, 0.0],
        quat=[np.cos(yaw), 0.0, 0.0, np.sin(yaw)],
    )
    _add_case(board)
    for key in LAYOUT:
        _add_key(board, key)
        _add_touch_sensor(spec, f"touch_{key.name}", f"key_{key.name}", "")
        _add_touch_sensor(spec, f"finger_{key.name}", f"key_{key.name}", finger_geom)
    for body in (PALM, PAYLOAD):
        for name in (KEYBOARD, *(f"key_{key.name}" for key in LAYOUT)):
            spec.add_exclude(bodyname1=body, bodyname2=name)


def free_fingertip(spec: mujoco.MjSpec, finger_geom: str) -> None:
    """Lets the pressing fingertip meet the floor with its capsule, not its sphere.

    Its contact force with the floor then always reads zero: it is no support, and a
    critic's input that is zero until a rare touch would be huge after normalization.

    Args:
        spec: scene with the hand.
        finger_geom: capsule of the pressing fingertip.
    """
    spec.geom(f"{finger_geom}_tip").conaffinity = 0
    spec.geom(finger_geom).conaffinity |= _FLOOR_BIT


def key_events(
    down: Bool[Array, " keys"],
    depth_m: Float[Array, " keys"],
    actuation_m: Float[Array, " keys"],
) -> tuple[Bool[Array, " keys"], Bool[Array, " keys"]]:
    """Electrical state of the keys after a step, and which were newly pressed.

    A key closes at its actuation depth d_a and opens h = `RELEASE_M` above it:
    closed ← d > d_a − h if closed, else d ≥ d_a.

    Args:
        down: closed before the step.
        depth_m: travel of each key [m].
        actuation_m: depth at which each key closes [m].

    Returns:
        Closed after the step, and the key-down events of the step.

    Source:
        CHERRY, data sheet "MX Series" (actuation); the hysteresis is ours.
    """
    closed = jnp.where(down, depth_m > actuation_m - RELEASE_M, depth_m >= actuation_m)
    return closed, closed & ~down


def key_spring(
    force_n: Float[Array, " keys"], actuation_m: Float[Array, " keys"]
) -> tuple[Float[Array, " keys"], Float[Array, " keys"]]:
    """Stiffness [N/m] and free length [m] of the springs under the keys.

    F(d) = F_a (s + (1 − s) d/d_a) with s = `REST_SHARE`: k = (1 − s) F_a/d_a, free at
    d = −d_a s/(1 − s).

    Args:
        force_n: F_a at the actuation depth [N].
        actuation_m: d_a [m].

    Source:
        CHERRY, data sheet "MX Series" (F_a and d_a); the share s is ours.
    """
    stiffness = (1.0 - REST_SHARE) * force_n / actuation_m
    return stiffness, -actuation_m * REST_SHARE / (1.0 - REST_SHARE)


def _add_case(board: mujoco.MjsBody) -> None:
    """A box under all keys, with a bezel around them."""
    half = np.array([[key.width, 1.0] for key in LAYOUT]) * PITCH_M / 2
    low = (KEY_CENTRES_M - half).min(axis=0) - _BEZEL_M
    high = (KEY_CENTRES_M + half).max(axis=0) + _BEZEL_M
    middle, size = (low + high) / 2, (high - low) / 2
    board.add_geom(
        name="keyboard_case",
        type=mujoco.mjtGeom.mjGEOM_BOX,
        pos=[*middle, _CASE_HEIGHT_M / 2],
        size=[*size, _CASE_HEIGHT_M / 2],
        contype=_HAND_BIT,
        conaffinity=0,
        condim=3,
        rgba=[0.30, 0.32, 0.35, 1],
    )


def _add_key(board: mujoco.MjsBody, key: Key) -> None:
    """A keycap on its slide; positive travel is down."""
    x, y = PITCH_M * key.right, PITCH_M * key.away
    body = board.add_body(name=f"key_{key.name}", pos=[x, y, TOP_M])
    stiffness = (1.0 - REST_SHARE) * FORCE_N / ACTUATION_M
    body.add_joint(
        name=f"key_{key.name}",
        type=mujoco.mjtJoint.mjJNT_SLIDE,
        axis=[0, 0, -1],
        range=[0.0, TRAVEL_M],
        limited=True,
        stiffness=[stiffness, 0.0, 0.0],
        springref=-ACTUATION_M * REST_SHARE / (1.0 - REST_SHARE),
        damping=[_DAMPING, 0.0, 0.0],
        armature=_ARMATURE_KG,
        solref_limit=[0.01, 1.0],
        solimp_limit=[0.99, 0.99, 0.001, 0.5, 2.0],
    )
    half_width = _CAP_M / 2 + (key.width - 1.0) * PITCH_M / 2
    arrow = key.name in ARROWS
    body.add_geom(
        name=f"key_{key.name}",
        type=mujoco.mjtGeom.mjGEOM_BOX,
        pos=[0.0, 0.0, -_CAP_HEIGHT_M / 2],
        size=[half_width, _CAP_M / 2, _CAP_HEIGHT_M / 2],
        mass=_MASS_KG,
        contype=_HAND_BIT,
        conaffinity=0,
        condim=3,
        # A light key under the hand's own soft contact would sink into the fingertip.
        priority=2,
        friction=[_CAP_FRICTION, 0.005, 0.0001],
        rgba=[0.95, 0.95, 0.93, 1] if arrow else [0.62, 0.64, 0.67, 1],
        **_RIGID,
    )


def _add_touch_sensor(spec: mujoco.MjSpec, name: str, geom: str, other: str) -> None:
    """Adds the number of contacts of a geom, with one other or with any."""
    found = 1 << int(mujoco.mjtConDataField.mjCONDATA_FOUND)
    mindist = 1  # MJX matches geoms only where it also sorts
    objects = mujoco.mjtObj
    spec.add_sensor(
        name=name,
        type=mujoco.mjtSensor.mjSENS_CONTACT,
        objtype=objects.mjOBJ_GEOM,
        objname=geom,
        reftype=objects.mjOBJ_GEOM if other else objects.mjOBJ_UNKNOWN,
        refname=other,
        intprm=[found, mindist, 1],
    )
