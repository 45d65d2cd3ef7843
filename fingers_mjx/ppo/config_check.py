"""Checks that the settings of a run fit together, before anything is compiled."""

from envs.config.typed import from_dict, to_dict
from envs.errors import InputError
from fingers_mjx.ppo.config import TrainConfig


def check_config(config: TrainConfig, source: object = "configuration") -> None:
    """Raises InputError at the first setting of `config` that cannot work.

    Args:
        config: settings of a run.
        source: file or option they came from, for the message.

    Raises:
        InputError: naming the field, what was found and what would be valid.
    """
    from_dict(TrainConfig, to_dict(config), source)
    parts = config.ppo.minibatches
    _check_multiple(source, "num_envs", config.num_envs, "ppo.minibatches", parts)
    for name in ("iterations", "log_every", "checkpoint_every"):
        value, per_call = getattr(config, name), config.iterations_per_call
        _check_multiple(source, name, value, "iterations_per_call", per_call)
    for name in ("actor_layers", "critic_layers"):
        if not getattr(config.ppo, name):
            raise InputError(source, f"ppo.{name}", "no layer", "one or more sizes")
    low, high = config.ppo.learning_rate_min, config.ppo.learning_rate_max
    rate = config.ppo.learning_rate
    if not low <= rate <= high:
        valid = f"from learning_rate_min ({low}) to learning_rate_max ({high})"
        raise InputError(source, "ppo.learning_rate", rate, valid)


def _check_multiple(
    source: object, name: str, value: int, unit_name: str, unit: int
) -> None:
    """Raises InputError if the field `name` is not a multiple of another."""
    if value % unit:
        raise InputError(source, name, value, f"a multiple of {unit_name} ({unit})")
