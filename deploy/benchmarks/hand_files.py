"""What the measurements run on: the hand's model, and a policy that marches in place.

A trained policy is better; this one needs no training: a clipped linear oscillator over
its own previous actions, which lifts the fingers in turn.
"""

from pathlib import Path

import numpy as np

import fingers_mjx
from envs.hand.hand_file import load_hand_file
from envs.hand.nominal import vendor_hand
from envs.hand.stance import load_stance
from envs.hand.standing_mjcf import standing_mjcf
from envs.registry import make_batch
from fingers_deploy.bundle import Bundle
from fingers_deploy.manifest import (
    Action,
    CommandPath,
    Interface,
    Normalizer,
    Observation,
    Provenance,
    Term,
)
from fingers_mjx.export.bundle import encode_bundle
from fingers_mjx.export.onnx_graph import PolicyWeights
from fingers_mjx.policy.interface import interface_of

WALKING = Path(fingers_mjx.__file__).parent / "policies" / "crawl"
"""The committed policy."""
HISTORY = 8
PERIOD_STEPS = 15
CLIP = 0.35  # small steps, so that the hand stands
TERMS = (
    Term("joint_pos", 20, "joint", "rad", 1.0, HISTORY),
    Term("gravity_b", 3, "palm", "1", 1.0, HISTORY),
    Term("angvel_b", 3, "palm", "rad/s", 1.0, HISTORY),
    Term("previous_action", 20, "joint", "1", 1.0, HISTORY),
    Term("command", 3, "V", "m/s m/s rad/s", 1.0, HISTORY),
)


def write_model(path: Path) -> Path:
    """Writes the calibrated hand in its stance as MJCF."""
    path.write_text(standing_mjcf(load_hand_file()), "utf-8")
    return path


def _joint_speeds() -> tuple[float, ...]:
    return tuple(load_hand_file().per_joint("speed_limit").tolist())


def hand_interface() -> Interface:
    """The crawl interface of the calibrated hand."""
    stance = load_stance()
    links = vendor_hand().links
    return Interface(
        joint_names=tuple(link.joint for link in links),
        reference_angles_rad=stance.joint_pos_rad,
        joint_limits_rad=tuple(tuple(link.range_rad) for link in links),
        initial_target_rad=stance.target_rad,
        control_rate_hz=50.0,
        observation=Observation(TERMS),
        action=Action(scale_rad=0.06, clip=CLIP),
        command_path=CommandPath(0.02, 3.0, _joint_speeds()),
        command_ranges=((0.0, 0.16), (-0.16, 0.16), (-0.45, 0.45)),
        v_quat_b=stance.q_off,
    )


def marching_bundle(task: str = "crawl") -> Bundle:
    """A policy that marches: a_t = 2ρ cos(ω) a_{t−1} − ρ² a_{t−2} − 2 (q_t − q_ref)."""
    growth, omega = 1.03, 2 * np.pi / PERIOD_STEPS
    weight, bias = np.zeros((392, 20)), np.zeros(20)
    newest_pos, newest_action = 7 * 20, 8 * 26 + 7 * 20
    for joint in range(20):
        weight[newest_pos + joint, joint] = -2.0  # back to the reference pose
    for finger, sign in enumerate((1, -1, 1, -1, 1)):
        joint = 4 * finger if finger else 1
        weight[newest_action + joint, joint] = 2 * growth * np.cos(omega)
        weight[newest_action - 20 + joint, joint] = -(growth**2)
        bias[joint] = 0.05 * sign
    return _bundle(task, hand_interface(), weight, bias)


def standing_bundle(task: str) -> Bundle:
    """A policy that stands in the stance of a task: its actions are all zero."""
    interface = interface_of(make_batch(task, 1))
    size = sum(term.size * term.history for term in interface.observation.terms)
    return _bundle(task, interface, np.zeros((size, 20)), np.zeros(20))


def _bundle(
    task: str, interface: Interface, weight: np.ndarray, bias: np.ndarray
) -> Bundle:
    """A bundle of one linear layer."""
    size, clip = len(weight), interface.action.clip
    zero, one = np.zeros(size, np.float32), np.ones(size, np.float32)
    layer = weight.astype(np.float32), bias.astype(np.float32)
    obs = np.random.default_rng(0).normal(0, 0.3, (8, size)).astype(np.float32)
    action = np.clip(obs @ layer[0] + layer[1], -clip, clip)
    provenance = Provenance("0" * 64, Normalizer(0, 0), None, {"fingers_deploy": "0"})
    weights = PolicyWeights((layer,), zero, one, clip)
    return encode_bundle(weights, task, interface, provenance, (obs, action))
