"""Settings of fall recovery."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

from envs.config.settings.commands import CommandConfig
from envs.config.settings.hand import HandSettings
from envs.config.settings.rows import check_weights

if TYPE_CHECKING:
    from rewards import RewardTable


def _no_command() -> CommandConfig:
    """A hand that gets up is asked to stand (ours; the paper gives no value)."""
    still = (0.0, 0.0)
    return CommandConfig(still, still, still)


@dataclass(frozen=True)
class RecoveryConfig(HandSettings):
    """Settings of fall recovery; the common ones are those of `HandSettings`.

    Attributes:
        command: the planar and yaw commands that the policy sees, as a crawl policy
            does (paper); nothing is paid for following them.
        settle: whether, as on the hand, the joint targets are taken to the stance once
            the upright detector has fired. Evaluations do so; in training the policy
            goes on, so that it learns to stay up (paper).
        practice_fraction: share of training episodes that start from a practice pose
            (`envs.tasks.recovery.practice`) instead of a fall (ours). With `settle`
            there are none.
        falls: which poses episodes start from; evaluations take the others (ours).
    """

    command: CommandConfig = field(default_factory=_no_command)
    settle: bool = False
    practice_fraction: float = field(default=0.0, metadata={"low": 0.0, "high": 1.0})
    falls: Literal["training", "held_out"] = "training"
    # A curled hand is near itself and the floor with many links: C MuJoCo counts up to
    # 14 contacts under random actions, and Warp's pool also holds the near pairs.
    contacts_per_world: int = field(default=96, metadata={"low": 1, "free": True})

    def __post_init__(self) -> None:
        super().__post_init__()
        check_weights(self, _table)


def _table() -> RewardTable:
    from rewards import RECOVERY

    return RECOVERY
