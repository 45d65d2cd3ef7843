"""The shim beside the environment: its measurements, and how far it is off."""

from functools import partial
from itertools import pairwise

import jax
import numpy as np

from fingers_deploy import PolicyController
from fingers_mjx.policy.actor import act


def driven(world, bundle, runtime, steps, seed=4):
    """States of one world that the shim drives, one more than actions."""
    reset, step = world
    controller = PolicyController(bundle, runtime)
    states = [jax.device_get(reset(jax.random.key(seed)))]
    while len(states) <= steps:
        controller.step(**measured(states[-1]))
        states.append(jax.device_get(step(states[-1], controller.action)))
    return states


def measured(state):
    """What encoders, IMU and operator report, in the shim's terms."""
    w, x, y, z = state.data.qpos[3:7]
    down_b = -np.array(
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]
    )
    return {
        "joint_pos": state.data.qpos[7:],
        "gravity_b": down_b,
        "angvel_b": state.data.qvel[3:6],
        "command": state.memory.command,
    }


def differences(bundle, runtime, states, change=lambda measured: measured):
    """Largest difference of observation, action and target over the rollout."""
    controller = PolicyController(bundle, runtime)
    decide = partial(act, bundle.network)
    clip = bundle.manifest.interface.action.clip
    worst = np.zeros(3)
    for state, after in pairwise(states):
        target = controller.step(**change(measured(state)))
        action = np.clip(decide(state.obs["state"]), -clip, clip)
        pairs = (
            (controller.observation, state.obs["state"]),
            (controller.action, action),
            (target, after.memory.target),
        )
        worst = np.maximum(worst, [np.abs(a - b).max() for a, b in pairs])
    return dict(zip(("observation", "action", "target"), worst, strict=True))
