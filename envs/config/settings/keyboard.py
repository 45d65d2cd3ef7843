"""Settings of keyboard pressing."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from envs.config.settings.hand import UprightSettings
from envs.config.settings.rows import check_weights
from envs.errors import InputError, check_ordered

if TYPE_CHECKING:
    from rewards import RewardTable

ACTUATION_M = 0.002
"""Depth at which a key is down by its data sheet [m]."""


@dataclass(frozen=True)
class RequestConfig:
    """When keys are asked for.

    Attributes:
        idle_s: uniform range of the gap before each request (ours; the paper's 32
            commands took 72.5 s).
        timeout_s: a request without a key event for so long has failed (ours).
    """

    idle_s: tuple[float, float] = field(
        default=(0.3, 1.2), metadata={"unit": "s", "low": 0.02}
    )
    timeout_s: float = field(default=1.5, metadata={"unit": "s", "low": 0.1})

    def __post_init__(self) -> None:
        check_ordered(self, "idle_s")


@dataclass(frozen=True)
class KeyboardVariation:
    """Ranges of the draws.

    Attributes:
        force_scale: factor on each key's operating force (data sheet: ± 0.7 oz of 2.1).
        actuation_m: actuation depth of each key (data sheet: 2.0 ± 0.6 mm).
        height_m: largest error of the keys' height (ours).
        align_m: largest error of the alignment, right and away (ours; the paper's
            operator aligns by trial presses).
        align_deg: largest error of the heading (ours).
    """

    force_scale: tuple[float, float] = field(
        default=(0.67, 1.33), metadata={"unit": "1", "low": 0.1}
    )
    actuation_m: tuple[float, float] = field(
        default=(0.0014, 0.0026), metadata={"unit": "m", "low": 0.001, "high": 0.0035}
    )
    height_m: float = field(default=0.0015, metadata={"unit": "m", "low": 0.0})
    align_m: float = field(default=0.003, metadata={"unit": "m", "low": 0.0})
    align_deg: float = field(default=3.0, metadata={"unit": "deg", "low": 0.0})

    def __post_init__(self) -> None:
        check_ordered(self, "force_scale", "actuation_m")


def nominal_keyboard() -> KeyboardVariation:
    """The keyboard of the data sheet, perfectly aligned."""
    depth = (ACTUATION_M, ACTUATION_M)
    return KeyboardVariation((1.0, 1.0), depth, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class KeyboardConfig(UprightSettings):
    """Settings of keyboard pressing; the others are those of `UprightSettings`.

    The tilt of V that is a loss of stance is that of crawling (ours).

    Attributes:
        max_drift_m: mean displacement of the supporting tips that is a loss of stance
            (ours).
        requests: when keys are asked for.
        keyboard: what differs from keyboard to keyboard.
    """

    action_scale_rad: float = field(default=0.028, metadata={"unit": "rad", "low": 0.0})
    reset_joint_rad: float = field(default=0.02, metadata={"unit": "rad", "low": 0.0})
    max_drift_m: float = field(default=0.03, metadata={"unit": "m", "low": 1e-3})
    requests: RequestConfig = field(default_factory=RequestConfig)
    keyboard: KeyboardVariation = field(default_factory=KeyboardVariation)
    # Warp's pool also holds pairs of links and keys that are only near each other.
    contacts_per_world: int = field(default=96, metadata={"low": 1, "free": True})

    def __post_init__(self) -> None:
        super().__post_init__()
        check_weights(self, _table)
        check_requests(self.requests, self.control_dt_s)


def check_requests(config: RequestConfig, dt_s: float) -> None:
    """Checks the times against the control interval.

    Raises:
        InputError: a gap shorter than a control step.
    """
    if config.idle_s[0] < dt_s:
        found, valid = config.idle_s[0], f">= {dt_s:g} s, a control step"
        raise InputError("configuration", "requests.idle_s", found, valid)


def _table() -> RewardTable:
    from rewards import KEYBOARD

    return KEYBOARD
