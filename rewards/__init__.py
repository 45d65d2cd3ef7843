"""Reward kernels for walking hands: pure functions of explicit arrays for one hand.

Kernels return magnitudes ≥ 0 and are safe under `jit`, `vmap` and `grad`; tables give
them weights and signs. The names carry frames and units: `_v` is the stance-calibrated
control frame V, `_w` the world.

    >>> import jax.numpy as jnp, rewards
    >>> table = tuple(row for row in rewards.CRAWL if row.name == "footprint")
    >>> weights = rewards.weights_at(rewards.table_weights(table), steps=0)
    >>> tips_v, stance_v = jnp.full((5, 3), 0.01), jnp.zeros((5, 3))
    >>> hand = {"tip_pos_v": tips_v, "footprint_target_v": stance_v}
    >>> total, terms = rewards.evaluate(table, hand, weights, dt_s=0.02)
    >>> print(f"{total:.6f}", f"{terms['footprint']:.6f}")
    -0.000675 -0.000675

`jax.vmap` over the signals evaluates many hands.
"""

import warnings
from importlib.util import find_spec
from pathlib import Path

from rewards.airtime import (
    AirTimeMemory,
    AirTimeParams,
    air_time_step,
    init_air_time_memory,
)
from rewards.compose import (
    RewardTable,
    RewardTerm,
    evaluate,
    precomputed,
    table_weights,
    weights_at,
)
from rewards.contact import foot_slide, shear_excess, undesired_contact
from rewards.direction import swing_against_command
from rewards.effort import joint_acceleration, overload, target_lag, torque
from rewards.footprint import (
    FootprintMemory,
    footprint_departure,
    footprint_step,
    init_footprint_memory,
)
from rewards.gates import in_contact, is_commanded
from rewards.keyboard import (
    fingertip_distance,
    keys_touched,
    other_depth,
    requested_depth,
    support_contact,
    support_drift,
)
from rewards.lift import (
    LiftMemory,
    LiftParams,
    init_lift_memory,
    lift_frequency_hz,
    lift_gate,
    lift_step,
)
from rewards.mean_velocity import (
    MeanErrorMemory,
    init_mean_error_memory,
    mean_error_step,
    track_mean_planar_velocity,
    track_mean_yaw_rate,
)
from rewards.motion import roll_pitch_rate, vertical_velocity
from rewards.posture import flat_orientation
from rewards.pushing import (
    object_at_target,
    object_delivered,
    object_progress,
    object_reached,
    object_regress,
)
from rewards.schedules import Constant, GeometricDecay, Schedule, StepSwitch
from rewards.shaping import safe_norm, smoothstep, tracking_kernel
from rewards.smoothness import action_rate
from rewards.stance import level_height, palm_tilt, stance_height, stance_pose
from rewards.tables.crawl import CRAWL, STEERING, STOCK
from rewards.tables.keyboard import KEYBOARD
from rewards.tables.names import TABLES
from rewards.tables.push import PUSH
from rewards.tables.recovery import RECOVERY
from rewards.tracking import track_planar_velocity, track_yaw_rate

__all__ = [
    "CRAWL",
    "KEYBOARD",
    "PUSH",
    "RECOVERY",
    "STEERING",
    "STOCK",
    "TABLES",
    "AirTimeMemory",
    "AirTimeParams",
    "Constant",
    "FootprintMemory",
    "GeometricDecay",
    "LiftMemory",
    "LiftParams",
    "MeanErrorMemory",
    "RewardTable",
    "RewardTerm",
    "Schedule",
    "StepSwitch",
    "action_rate",
    "air_time_step",
    "evaluate",
    "fingertip_distance",
    "flat_orientation",
    "foot_slide",
    "footprint_departure",
    "footprint_step",
    "in_contact",
    "init_air_time_memory",
    "init_footprint_memory",
    "init_lift_memory",
    "init_mean_error_memory",
    "is_commanded",
    "joint_acceleration",
    "keys_touched",
    "level_height",
    "lift_frequency_hz",
    "lift_gate",
    "lift_step",
    "mean_error_step",
    "object_at_target",
    "object_delivered",
    "object_progress",
    "object_reached",
    "object_regress",
    "other_depth",
    "overload",
    "palm_tilt",
    "precomputed",
    "requested_depth",
    "roll_pitch_rate",
    "safe_norm",
    "shear_excess",
    "smoothstep",
    "stance_height",
    "stance_pose",
    "support_contact",
    "support_drift",
    "swing_against_command",
    "table_weights",
    "target_lag",
    "torque",
    "track_mean_planar_velocity",
    "track_mean_yaw_rate",
    "track_planar_velocity",
    "track_yaw_rate",
    "tracking_kernel",
    "undesired_contact",
    "vertical_velocity",
    "weights_at",
]

_HERE = Path(__file__).resolve().parents[1]
for _name in ("envs", "sysid"):  # common names, of which there may be others
    _spec = find_spec(_name)
    _origin = _spec and _spec.origin
    if _origin and Path(_origin).resolve().parent != _HERE / _name:
        # Nothing here needs it, so a project with a package of that name goes on.
        warnings.warn(
            f"package {_name}: found {_origin}; valid: {_HERE / _name}, so install "
            "fingers-mjx into an environment of its own and run it from a directory "
            f"without {_name}",
            stacklevel=2,
        )
