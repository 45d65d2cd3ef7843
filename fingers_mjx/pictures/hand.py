"""Pictures of the settled stance: V, fingertips, pads and support polygon."""

from collections.abc import Mapping
from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Float, UInt8
from scipy.spatial import ConvexHull

from envs.hand.hand_file import HandFile
from envs.hand.model import V_SITE, build_model
from envs.hand.spec import HandSpec, hand_spec
from envs.hand.stance import Stance
from envs.hand.support import support_margins
from fingers_mjx.pictures.camera import Camera
from fingers_mjx.pictures.overlay import (
    Area,
    Dots,
    Item,
    Label,
    Line,
    caption,
    draw,
    frame_axes,
)
from fingers_mjx.pictures.raycast import render
from fingers_mjx.pictures.shade import Look

# Heading of the view; V points along world x in the stance.
SIDES: Mapping[str, float] = {"front": 180.0, "left": 270.0, "back": 0.0, "right": 90.0}
SIZE = (960, 720)
LOOK = Look(sky_samples=8)
PAD_M, AXIS_M, FLOOR_M = 0.02, 0.045, 0.0005
BELOW_M = np.array([0.0, 0.0, -0.012])
PAD_COLOUR, COM_COLOUR = (200, 30, 120), (0, 90, 150)


@dataclass(frozen=True)
class Posed:
    """A hand in its stance.

    Attributes:
        model: the scene.
        data: everything that follows from the pose.
    """

    model: mujoco.MjModel
    data: mujoco.MjData

    @property
    def spec(self) -> HandSpec:
        """Names in the scene."""
        return hand_spec(self.model)

    @property
    def tips_w(self) -> Float[np.ndarray, "tips 3"]:
        """Centres of the fingertips [m]."""
        return np.array([self.data.site(name).xpos for name in self.spec.tip_sites])

    @property
    def pads_w(self) -> Float[np.ndarray, "tips 3"]:
        """Unit normals of the pads, away from the nail."""
        sites = [self.data.site(name) for name in self.spec.tip_sites]
        return np.array([site.xmat.reshape(3, 3)[:, 0] for site in sites])

    @property
    def com_w(self) -> Float[np.ndarray, "3"]:
        """Centre of mass of hand and payload [m]."""
        return self.data.subtree_com[1].copy()


def posed(hand: HandFile, stance: Stance) -> Posed:
    """Puts a hand into its stance."""
    model = build_model(hand, np.array(stance.q_off))
    data = mujoco.MjData(model)
    data.qpos[:], data.ctrl[:] = stance.qpos, stance.target_rad
    mujoco.mj_forward(model, data)
    return Posed(model, data)


def pictures(hand: Posed) -> dict[str, UInt8[np.ndarray, "h w 3"]]:
    """Returns a picture from each of `SIDES` by its name."""
    return {name: _picture(hand, name, azimuth) for name, azimuth in SIDES.items()}


def facts(hand: Posed) -> dict[str, float]:
    """Returns what the pictures show, in numbers.

    palm_height_mm: origin of the palm above the floor. palm_pitch_deg: the palm's long
    axis (wrist to fingers) below the horizontal. static_margin_mm: from the centre of
    mass to the nearest edge of the support polygon. pad_tilt_deg_<finger>: elevation of
    the pad's normal, -90 flat on the pad, +90 on the nail.
    """
    palm = hand.data.body("palm")
    margins = support_margins(hand.com_w[:2], hand.tips_w[:, :2])
    tilts = np.degrees(np.arcsin(np.clip(hand.pads_w[:, 2], -1, 1)))
    return {
        "palm_height_mm": 1000 * float(palm.xpos[2]),
        "palm_pitch_deg": float(np.degrees(np.arcsin(-palm.xmat.reshape(3, 3)[2, 2]))),
        "static_margin_mm": 1000 * float(margins.min()),
        **{
            f"pad_tilt_deg_{finger}": float(tilt)
            for finger, tilt in zip(hand.spec.fingers, tilts, strict=True)
        },
    }


def _picture(hand: Posed, name: str, azimuth_deg: float) -> UInt8[np.ndarray, "h w 3"]:
    middle = hand.tips_w.mean(axis=0)
    lookat = (float(middle[0]) * 0.6, float(middle[1]), 0.075)
    camera = Camera(lookat, 0.42, azimuth_deg, -16.0)
    image = render(hand.model, hand.data, camera, SIZE, LOOK)
    return caption(draw(image, camera, _items(hand)), f"stance, from the {name}")


def _items(hand: Posed) -> list[Item]:
    tips, pads = hand.tips_w, hand.pads_w
    floor = tips * [1, 1, 0] + [0, 0, FLOOR_M]
    hull = floor[ConvexHull(floor[:, :2]).vertices]
    com = hand.com_w
    foot = com * [1, 1, 0] + [0, 0, FLOOR_M]
    site = hand.data.site(V_SITE)
    axes = ("V x forward", "y left", "z up")
    items: list[Item] = [
        Area(hull),
        Line(np.stack([com, foot]), COM_COLOUR, 1.5, 0.7),
        Dots(np.stack([com, foot]), COM_COLOUR, 4.0),
        Label(foot, "centre of mass", COM_COLOUR),
        *(
            Line(np.stack([t, t + PAD_M * p]), PAD_COLOUR, 3.0)
            for t, p in zip(tips, pads, strict=True)
        ),
        Dots(tips, PAD_COLOUR, 4.0),
        *(
            Label(t + BELOW_M, f, PAD_COLOUR)
            for t, f in zip(tips, hand.spec.fingers, strict=True)
        ),
    ]
    return items + frame_axes(site.xpos, site.xmat.reshape(3, 3), AXIS_M, axes)
