"""Reward table of object pushing: the crawl's, and four goals of the object.

The rows bind attributes of `envs.signals.Signals`, what the crawl's rows bind, and six
extras that the caller adds: `pocket_to_object_m`, `progress_mps` and `target_error_m`,
see `rewards.pushing`, `effort_share` and `joint_lag_rad`, see `rewards.effort`, and
`fallen`, 1 in the step in which the hand falls.

The paper names the goals (approach, move toward the target, keep there) and keeps the
terms of support and regularization, without weights. The goals' weights are ours: a
cube that is pushed at 5 cm/s pays as much as perfect tracking, a delivered one four
times that. A fall is paid once, 10 at an interval of 20 ms: about what the two seconds
pay that a discount of 0.99 looks ahead.
"""

from rewards.compose import RewardTable, RewardTerm, precomputed
from rewards.effort import overload, target_lag
from rewards.pushing import (
    object_at_target,
    object_delivered,
    object_progress,
    object_reached,
    object_regress,
)
from rewards.tables.crawl import CRAWL
from rewards.tracking import track_yaw_rate

_WALK: RewardTable = tuple(row for row in CRAWL if row.name != "track_yaw_rate")

PUSH: RewardTable = (
    RewardTerm("object_reached", object_reached, 0.5, ("pocket_to_object_m",)),
    RewardTerm("object_progress", object_progress, 20.0, ("progress_mps",)),
    RewardTerm("object_regress", object_regress, -20.0, ("progress_mps",)),
    RewardTerm("object_at_target", object_at_target, 3.0, ("target_error_m",)),
    RewardTerm("object_delivered", object_delivered, 1.0, ("target_error_m",)),
    RewardTerm("fallen", precomputed, -500.0, ("fallen",)),
    RewardTerm("overload", overload, -1.0, ("effort_share",)),
    RewardTerm("target_lag", target_lag, -1.0, ("joint_lag_rad",)),
    RewardTerm("track_yaw_rate", track_yaw_rate, 0.5, ("angvel_v", "command")),
    *_WALK,
)
"""The goals of pushing (paper) with weights of ours, on the crawl reward."""
