"""What measuring changes of the settings that a policy was trained with."""

import dataclasses
from collections.abc import Sequence
from typing import Any

from envs.config.settings.keyboard import KeyboardConfig, nominal_keyboard
from envs.config.settings.randomize import no_randomization
from envs.errors import InputError
from fingers_mjx.runs.setup import Setup


def nominal(setup: Setup) -> Setup:
    """Returns `setup` with the nominal hand, and no noise, not at the start either.

    A keyboard has its nominal parameters, and lies where it should.
    """
    calm = no_randomization(setup.hand.tip_friction.value)
    still: dict[str, Any] = {"reset_joint_rad": 0.0, "reset_speed_mps": 0.0}
    if isinstance(setup.env, KeyboardConfig):
        still["keyboard"] = nominal_keyboard()
    return with_fields(setup, randomize=calm, **still)


def as_deployed(setup: Setup) -> Setup:
    """Returns `setup` with what the shim does beside the policy.

    Of a recovery it is the end: detector and ramp (`envs.tasks.recovery.settle`). It
    starts from poses that training has not seen.
    """
    return with_fields(setup, settle=True, falls="held_out")


def without_practice(setup: Setup) -> Setup:
    """Returns `setup` with episodes that all begin as the task says.

    Only training starts from practice poses (`envs.tasks.recovery.practice`).
    """
    return with_fields(setup, practice_fraction=0.0)


def with_command(setup: Setup, command: Sequence[float]) -> Setup:
    """Returns `setup` with one command for all of every episode.

    Args:
        setup: settings.
        command: v_x, v_y [m/s] and yaw rate [rad/s], in V.

    Raises:
        InputError: the task has no commands.
    """
    if not hasattr(setup.env, "command"):
        valid = "no --command: this task has none"
        raise InputError("--command", "", setup.train.task, valid)
    ranges = [(float(value), float(value)) for value in command]
    fields = ("vel_x_mps", "vel_y_mps", "yaw_rate_rps")
    fixed = dict(zip(fields, ranges, strict=True))
    names = (field.name for field in dataclasses.fields(setup.env.command))
    shares = {name: 0.0 for name in names if name.endswith("_fraction")}
    changed = dataclasses.replace(setup.env.command, **fixed, **shares)
    return with_fields(setup, command=changed)


def with_fields(setup: Setup, **changes: Any) -> Setup:
    """Returns `setup` with those of the changes whose fields its task has."""
    known = {k: v for k, v in changes.items() if hasattr(setup.env, k)}
    return dataclasses.replace(setup, env=dataclasses.replace(setup.env, **known))
