"""Settings of the crawl task."""

from dataclasses import dataclass, field

from envs.config.settings.commands import CommandConfig
from envs.config.settings.hand import UprightSettings
from envs.config.settings.rows import check_weights, table_of
from envs.errors import InputError

PAPER = "footprint"
"""The paper's reward table."""


@dataclass(frozen=True)
class CrawlConfig(UprightSettings):
    """Settings of the crawl task; the others are those of `UprightSettings`.

    Attributes:
        rewards: name of the reward table, see `rewards.TABLES`; "footprint" is the
            paper's, "stock" the one that the paper compares it with, "steering" the
            first with rows for the mean velocity (ours).
        reset_speed_mps: largest base speed at reset, each axis (ours).
        command: ranges of the commands.
    """

    rewards: str = PAPER
    reset_speed_mps: float = field(default=0.05, metadata={"unit": "m/s", "low": 0.0})
    command: CommandConfig = field(default_factory=CommandConfig)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.rewards != PAPER:
            table_of("crawl", self.rewards)
        check_weights(self, lambda: table_of("crawl", self.rewards))
        if self.command.resample_s < self.control_dt_s:
            found, valid = self.command.resample_s, f">= {self.control_dt_s:g} s"
            raise InputError("configuration", "command.resample_s", found, valid)
