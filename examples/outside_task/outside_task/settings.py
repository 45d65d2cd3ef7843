"""Settings of crouching, and the task as the entry point names it; without JAX."""

from dataclasses import dataclass, field

from envs.config.settings.commands import CommandConfig
from envs.config.settings.hand import HandSettings
from envs.registry import Task, deferred


@dataclass(frozen=True)
class CrouchConfig(HandSettings):
    """Settings of crouching; the others are those of `HandSettings`.

    Attributes:
        height_m: height at which the palm is to be held.
        command: ranges of the commands that the policy sees; nothing is paid for them.
    """

    height_m: float = field(default=0.06, metadata={"unit": "m", "low": 0.0})
    command: CommandConfig = field(default_factory=CommandConfig)


CROUCH = Task(
    CrouchConfig,
    deferred("outside_task.task:Crouch.on"),
    summary="hold the palm low over the fingertips",
)
