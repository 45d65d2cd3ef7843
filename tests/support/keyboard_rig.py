"""The hand before the keyboard in C MuJoCo, pressing by inverse kinematics.

The stance stays under its targets; only the pressing finger moves, no faster than a
policy may move it. No learning is in it: it shows what the physics allows.
"""

from dataclasses import dataclass

import mujoco
import numpy as np

from envs.config.settings.keyboard import KeyboardConfig
from envs.hand.hand_file import load_hand_file
from envs.hand.model import PHYSICS_DT_S
from envs.hand.nominal import vendor_hand
from envs.scene import build_scene
from envs.tasks.keyboard.model import (
    ACTUATION_M,
    ARROWS,
    KEY_CENTRES_M,
    KEY_NAMES,
    TOP_M,
    add_keyboard,
    free_fingertip,
)
from envs.tasks.keyboard.stance import (
    FINGER,
    FINGER_INDEX,
    JOINTS,
    PLACEMENT,
    TIP_RADIUS_M,
    keyboard_stance,
)
from fingers_robot.simulator.command_path import CommandPath

TIP_LINKS = tuple(link.body for link in vendor_hand().tip_links)
HAND_NQ = 27
LIFT_M = 0.010
STEP_RAD = KeyboardConfig().action_scale_rad
SUBSTEPS = 4


@dataclass
class Press:
    """What one request led to."""

    asked: str
    pressed: tuple[str, ...]
    latency_s: float
    tilt_deg: float


class Rig:
    """One hand, one keyboard.

    Args:
        shift_m: of the keyboard, right and away.
        friction: of the fingertips.
    """

    def __init__(self, shift_m=(0.0, 0.0), friction=0.88):
        self.hand = load_hand_file()
        self.stance = keyboard_stance(self.hand)
        spec = build_scene(self.hand, self.stance.q_off, self.add)
        self.model = spec.compile()
        x, y = PLACEMENT.to_world(np.array([shift_m]))[0]
        self.model.body("keyboard").pos[:2] = x, y
        for link in TIP_LINKS:
            for name in (link, f"{link}_tip"):
                self.model.geom(name).friction[0] = friction
        self.data = mujoco.MjData(self.model)
        self.data.qpos[:HAND_NQ] = self.stance.qpos
        self.rest = np.array(self.stance.target_rad)
        self.target = self.rest.copy()
        self.path = CommandPath(self.target.copy(), PHYSICS_DT_S, 0.019, 3.0, 2.8)
        self.site = self.model.site(f"{FINGER}_tip").id
        points = self.press_points()
        self.goals = {name: self.reach(place) for name, place in points.items()}
        lift = np.array([0.0, 0.0, LIFT_M])
        self.above = {name: self.reach(place + lift) for name, place in points.items()}
        self.down = np.zeros(len(KEY_NAMES), bool)

    def add(self, spec):
        add_keyboard(spec, PLACEMENT, TIP_LINKS[FINGER_INDEX])
        free_fingertip(spec, TIP_LINKS[FINGER_INDEX])

    def press_points(self):
        """Where the tip's centre goes to press each arrow key of the nominal place."""
        height = TOP_M + TIP_RADIUS_M - ACTUATION_M - 0.001
        arrows = PLACEMENT.to_world(KEY_CENTRES_M[: len(ARROWS)])
        return {
            name: np.r_[place, height]
            for name, place in zip(ARROWS, arrows, strict=True)
        }

    def reach(self, point_w):
        """Joint angles of the pressing finger that bring its tip to a point."""
        data = mujoco.MjData(self.model)
        data.qpos[:HAND_NQ] = self.stance.qpos
        columns = slice(6 + JOINTS.start, 6 + JOINTS.stop)
        jacobian = np.zeros((3, self.model.nv))
        for _ in range(50):
            mujoco.mj_kinematics(self.model, data)
            mujoco.mj_comPos(self.model, data)
            mujoco.mj_jacSite(self.model, data, jacobian, None, self.site)
            j = jacobian[:, columns]
            error = point_w - data.site_xpos[self.site]
            step = j.T @ np.linalg.solve(j @ j.T + 1e-6 * np.eye(3), error)
            data.qpos[7 + JOINTS.start : 7 + JOINTS.stop] += step
        self.reach_error_m = float(np.linalg.norm(error))
        return data.qpos[7 + JOINTS.start : 7 + JOINTS.stop].copy()

    def step(self, goal):
        """One control step towards joint targets; returns the keys newly pressed."""
        self.target += np.clip(goal - self.target, -STEP_RAD, STEP_RAD)
        for _ in range(SUBSTEPS):
            self.data.ctrl[:] = self.path.step(self.target)
            mujoco.mj_step(self.model, self.data)
        depth = self.data.qpos[HAND_NQ:]
        down = np.where(self.down, depth > ACTUATION_M - 4e-4, depth >= ACTUATION_M)
        new, self.down = down & ~self.down, down
        return tuple(np.array(KEY_NAMES)[new])

    def press(self, name, pause_s=0.5):
        """Asks for a key, then pauses; everything pressed on the way counts."""
        goal, above = self.rest.copy(), self.rest.copy()
        goal[JOINTS], above[JOINTS] = self.goals[name], self.above[name]
        events, latency, tilt = (), np.nan, 0.0
        for count in range(1, 76):
            events += self.step(goal)
            tilt = max(tilt, self.tilt_deg())
            if events:
                latency = 0.02 * count
                break
        for count in range(round(pause_s / 0.02)):
            events += self.step(above if count < 10 else self.rest)
            tilt = max(tilt, self.tilt_deg())
        return Press(name, events, latency, tilt)

    def tilt_deg(self):
        up = self.data.site("control_frame").xmat[8]
        return float(np.rad2deg(np.arccos(np.clip(up, -1, 1))))

    def feet_w(self):
        names = ("thumb", "index", "ring", "little")
        return np.array([self.data.site(f"{n}_tip").xpos[:2] for n in names])
