"""Typing, pushing, getting up and stopping under the supervisor.

    python deploy/benchmarks/task_runs.py --trials 10

Everything is the shim's own code, as in `faults.lab`; the scenes are those of training;
keys are asked for, their events come from the scene; a camera's samples go through the
socket, 60 of them a second and 40 ms late. A hand that has fallen is armed for recovery
in fallen poses that training never saw, and is to stand under the crawl policy again. A
hand that walks is stopped by the operator.
"""

import argparse
import copy
import json
import socket
import sys
import tempfile
from pathlib import Path

import mujoco
import numpy as np
from faults.lab import Lab
from hand_files import WALKING, write_model

from envs.registry import make_batch
from envs.tasks.keyboard.model import ACTUATION_M, ARROWS
from envs.tasks.push.scene import HALF_M
from envs.tasks.recovery.falls import load_falls
from fingers_deploy.bundle import load_bundle
from fingers_deploy.rotations import multiply
from fingers_robot.behaviour.command import FixedCommand
from fingers_robot.behaviour.heading import heading
from fingers_robot.behaviour.keyboard.runner import KeyRunner
from fingers_robot.behaviour.tracker_port import TrackerPort
from fingers_robot.behaviour.upright import tilt_angle
from fingers_robot.safety import Mode, Operator

POLICIES = WALKING.parent
TASKS = ("keyboard", "push", "recovery", "stop")
CAMERA_S, LATE_S, CONTROL_S = 1 / 60, 0.04, 0.02
ENTER_M = 0.02
EVERY_FALL = 6
"""Every so many falls that training never saw are tried."""
FALLEN_RAD, LEVEL_RAD, STOPS = 0.7, 0.17, 24


class TypedOn:
    """The keyboard of the scene as a source of key events; arrows only."""

    def __init__(self, lab: Lab):
        self.lost, self._data = False, lab.driver.hand.data
        model = lab.driver.hand.model
        ids = [model.joint(f"key_{name}").id for name in ARROWS]
        self._place = model.jnt_qposadr[ids]
        self._down = np.zeros(len(ids), bool)

    def poll(self) -> tuple[str, ...]:
        """As the protocol says."""
        down = self._data.qpos[self._place] >= ACTUATION_M
        pressed, self._down = down & ~self._down, down
        return tuple(np.array(ARROWS)[pressed].tolist())


def scene(task: str, folder: Path, seed: int) -> Lab:
    """A lab with the scene of a task and its committed policy, in its stance."""
    env = make_batch(task, 1)
    path = folder / f"{task}.mjb"
    mujoco.mj_saveModel(env.mj_model, str(path), None)
    bundle = load_bundle(POLICIES / task)
    lab = Lab(path, (bundle,), sticks=(), loop_hz=250, seed=seed)
    hand = lab.driver.hand
    hand.data.qpos[: len(env.stance.qpos)] = env.stance.qpos
    mujoco.mj_forward(hand.model, hand.data)
    hand.target_rad = hand.data.qpos[hand._qpos].copy()
    return lab


def type_keys(folder: Path, keys: tuple[str, ...], seed: int) -> dict:
    """Types a list of keys; returns what came of it."""
    lab = scene("keyboard", folder, seed)
    runner = KeyRunner(keys, TypedOn(lab))
    lab.link.policies.sources.keys = runner
    lab.activate()
    lab.run(1.0 * len(keys) + 2.0)
    outcomes = runner._state.outcomes
    return {
        "keys": len(outcomes),
        "correct": sum(outcome.correct for outcome in outcomes),
        "latency_s": [round(outcome.latency_s, 2) for outcome in outcomes],
        "faults": [fault.id for fault in lab.core.state.faults],
    }


def push_cube(folder: Path, seed: int, seconds: float = 20.0) -> dict:
    """Pushes the cube to a target; returns what came of it."""
    lab, rng = scene("push", folder, seed), np.random.default_rng(seed)
    target = _place_cube(lab, rng)
    path = folder / f"tracker-{seed}"
    port = TrackerPort(path, lab.core.limits.v_quat_b)
    lab.link.policies.sources.tracker = port
    camera = Camera(lab, path, target)
    lab.between = camera.look
    lab.run(0.1)
    lab.activate()
    begin, efforts, best = lab.clock.t, [], np.inf
    while lab.clock.t - begin < seconds and lab.mode == Mode.ACTIVE:
        lab.run(CONTROL_S)
        efforts.append(np.abs(lab.driver.hand.state()["effort"]).max())
        best = min(best, float(np.linalg.norm(_cube(lab)[:2] - target)))
        if best < ENTER_M:
            break
    camera.close()
    port.close()
    return {
        "delivered": best < ENTER_M,
        "nearest_m": round(best, 3),
        "after_s": round(lab.clock.t - begin, 1),
        "at_effort_limit": round(float((np.array(efforts) > 0.9).mean()), 2),
        "faults": [fault.id for fault in lab.core.state.faults],
    }


class Camera:
    """Sends what it sees of a lab to a socket, some time later."""

    def __init__(self, lab: Lab, path: Path, target: np.ndarray):
        self._lab, self._path, self._target = lab, str(path), target
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._waiting: list[tuple[float, bytes]] = []
        self._taken = 0

    def look(self) -> None:
        """Takes a sample if one is due, and sends what is old enough."""
        t = self._lab.clock.t
        if t >= self._taken * CAMERA_S:
            self._taken += 1
            self._waiting.append((t + LATE_S, json.dumps(self._sample(t)).encode()))
        while self._waiting and self._waiting[0][0] <= t:
            self._socket.sendto(self._waiting.pop(0)[1], self._path)

    def close(self) -> None:
        """Lets go of the socket."""
        self._socket.close()

    def _sample(self, t: float) -> dict:
        qpos = self._lab.driver.hand.data.qpos
        v_quat = self._lab.core.limits.v_quat_b
        return {
            "t_s": t,
            "object_pos_w": _cube(self._lab).tolist(),
            "root_pos_w": qpos[:3].tolist(),
            "heading_rad": heading(multiply(qpos[3:7], v_quat)),
            "target_pos_w": [*self._target.tolist(), HALF_M],
        }


def stop_walking(folder: Path, wait_s: float, trials: int) -> dict:
    """Stops at full speed, at `trials` phases of the gait; returns how many fell.

    Args:
        folder: for the model.
        wait_s: time without a command before the operator's stop.
        trials: how often.
    """
    model = write_model(folder / "hand.xml")
    lab = Lab(model, (load_bundle(WALKING),), sticks=(1.0, 0.0, 0.0), loop_hz=250)
    lab.activate().run(2.5)
    falls = 0
    for _ in range(trials):
        stopped = copy.deepcopy(lab.run(0.11))
        if wait_s:
            stopped.link.policies.sources.command = FixedCommand(())
            stopped.run(wait_s)
        stopped.tick(Operator.STOP)
        stopped.run(2.2)
        level = tilt_angle(
            stopped.driver.hand.data.qpos[3:7], stopped.core.limits.v_quat_b
        )
        falls += level > FALLEN_RAD
    return {"wait_s": wait_s, "stops": trials, "falls": falls}


def get_up(folder: Path, number: int) -> dict:
    """Arms a hand that has fallen for recovery; returns what came of it.

    Args:
        folder: for the model.
        number: of the fallen pose.
    """
    env, falls = make_batch("recovery", 1), load_falls(held_out=True)
    path = folder / "recovery.mjb"
    mujoco.mj_saveModel(env.mj_model, str(path), None)
    both = tuple(load_bundle(POLICIES / name) for name in ("crawl", "recovery"))
    lab = Lab(path, both, sticks=(), loop_hz=250, seed=number)
    hand, lab.core.selected = lab.driver.hand, 1
    hand.data.qpos[:27] = falls.qpos[number]
    mujoco.mj_forward(hand.model, hand.data)
    hand.target_rad = np.array(falls.target_rad[number])
    lab.activate()
    begin = lab.clock.t
    while lab.mode == Mode.ACTIVE and lab.link.policies.active == 1:
        lab.run(CONTROL_S)
    took_s = lab.clock.t - begin
    lab.run(2.0)
    level = tilt_angle(hand.data.qpos[3:7], lab.core.limits.v_quat_b)
    return {
        "side": falls.side[number],
        "up": lab.mode == Mode.ACTIVE and level < LEVEL_RAD,
        "after_s": round(took_s, 1),
        "faults": [fault.id for fault in lab.core.state.faults],
    }


def _place_cube(lab: Lab, rng: np.random.Generator) -> np.ndarray:
    """Puts the cube before the hand; returns its target, [2]."""
    qpos = lab.driver.hand.data.qpos
    ahead = heading(multiply(qpos[3:7], lab.core.limits.v_quat_b))
    side, far, turn = rng.uniform((-0.35, 0.17, -0.7), (0.35, 0.26, 0.7))
    place = qpos[:2] + far * _toward(ahead + side)
    qpos[27:30] = *place, HALF_M
    return place + rng.uniform(0.1, 0.3) * _toward(ahead + turn)


def _cube(lab: Lab) -> np.ndarray:
    return lab.driver.hand.data.qpos[27:30].copy()


def _toward(angle: float) -> np.ndarray:
    return np.array([np.cos(angle), np.sin(angle)])


def main() -> int:
    """Runs the measurement and prints it as JSON."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--trials", type=int, default=5)
    parser.add_argument("--tasks", nargs="+", choices=TASKS, default=list(TASKS))
    options = parser.parse_args()
    falls = range(0, len(load_falls(held_out=True).side), EVERY_FALL)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        keys, trials = ARROWS * 2, range(options.trials)
        runs = {
            "keyboard": lambda: [type_keys(folder, keys, k) for k in trials],
            "push": lambda: [push_cube(folder, k) for k in trials],
            "recovery": lambda: [get_up(folder, k) for k in falls],
            "stop": lambda: [stop_walking(folder, w, STOPS) for w in (0.0, 0.5)],
        }
        results = {task: runs[task]() for task in options.tasks}
    print(json.dumps(results, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
