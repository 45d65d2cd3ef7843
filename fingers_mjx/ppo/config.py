"""Settings of a training run: frozen, documented, typed; presets."""

import dataclasses
from dataclasses import dataclass
from typing import Any, Literal

from envs.config.typed import from_dict, to_dict
from envs.errors import InputError, one_of

POSITIVE = 1e-9
"""Lower bound of numbers that must be above zero."""
MAX_WORLDS, MAX_ITERATIONS, MAX_SIZE = 2**20, 10**7, 2**16
"""Bounds beyond any machine, within which no counter of 32 bits overflows."""
SMALL_MEAN_SCALE = 0.01
"""`init_mean_scale` of policies that hardly act at the start (ours)."""


def _number(default: Any, low: Any, high: Any = None, **notes: Any) -> Any:
    """Returns a field with a range; `free=True` if a resumed run may change it."""
    limits = {"low": low} if high is None else {"low": low, "high": high}
    return dataclasses.field(default=default, metadata=limits | notes)


def _free(default: Any) -> Any:
    """Returns a field that a resumed run may change."""
    return dataclasses.field(default=default, metadata={"free": True})


@dataclass(frozen=True)
class PpoConfig:
    """Proximal policy optimization.

    Defaults are the paper's values where it gives any; the others are marked as ours.

    Attributes:
        unroll_length: control steps per world and iteration.
        epochs: passes over the data of one iteration.
        minibatches: parts into which the worlds are split in each pass.
        clip: ε of the clipped surrogate objective.
        discount: γ per control step.
        gae_lambda: λ of the generalized advantage estimate.
        entropy_cost: weight of the entropy bonus.
        value_cost: weight of the value loss, which is half the mean squared error
            (ours).
        learning_rate: rate of Adam at the start.
        learning_rate_min: lower bound of the adaptive rate (ours).
        learning_rate_max: upper bound of the adaptive rate (ours).
        desired_kl: divergence per update that the adaptive rate aims at (ours).
        max_grad_norm: global norm to which gradients are clipped (ours).
        actor_layers: hidden sizes of the policy.
        critic_layers: hidden sizes of the value function (ours; the paper states those
            of keyboard and pushing, see `preset`).
        init_noise_std: standard deviation of the action noise at the start (ours).
        init_mean_scale: factor on the weights of the policy's last layer at the start
            (ours). Actions move targets on, so that outputs of usual size throw the
            hand over within a second; with small ones it stands, and learns from there.
        noise_std_type: "log" learns log σ, which cannot turn negative; "scalar" σ
            (ours).
        critic_iterations: iterations at the start in which the critic alone learns; the
            policy then begins with `learning_rate_min` (ours). A bundle brings no
            critic, and the advantages of an untrained one unlearn within a few updates
            what the policy can.
        reward_scale: factor on the reward that the learner sees (ours).
        max_bad_updates: consecutive updates skipped as non-finite that stop the run
            (ours).
    """

    unroll_length: int = _number(24, 1, MAX_SIZE)
    epochs: int = _number(5, 1, MAX_SIZE)
    minibatches: int = _number(4, 1, MAX_WORLDS)
    clip: float = _number(0.2, POSITIVE)
    discount: float = _number(0.99, 0.0, 1.0)
    gae_lambda: float = _number(0.95, 0.0, 1.0)
    entropy_cost: float = _number(0.005, 0.0)
    value_cost: float = _number(1.0, 0.0)
    learning_rate: float = _number(1e-3, POSITIVE)
    learning_rate_min: float = _number(1e-5, POSITIVE)
    learning_rate_max: float = _number(1e-2, POSITIVE)
    desired_kl: float = _number(0.01, POSITIVE)
    max_grad_norm: float = _number(1.0, POSITIVE)
    actor_layers: tuple[int, ...] = _number((512, 256, 128), 1, MAX_SIZE)
    critic_layers: tuple[int, ...] = _number((512, 256, 128), 1, MAX_SIZE)
    init_noise_std: float = _number(1.0, POSITIVE)
    init_mean_scale: float = _number(1.0, POSITIVE)
    noise_std_type: Literal["log", "scalar"] = "log"
    critic_iterations: int = _number(0, 0, MAX_ITERATIONS)
    reward_scale: float = _number(1.0, POSITIVE)
    max_bad_updates: int = _number(4, 1, MAX_ITERATIONS)


@dataclass(frozen=True)
class TrainConfig:
    """One training run.

    Attributes:
        task: registered name of the environment.
        preset: name of the preset from which the run started.
        seed: of networks, environments and action noise.
        backend: physics backend of the environment.
        num_envs: worlds stepped in parallel.
        iterations: PPO iterations in all.
        iterations_per_call: iterations compiled into one device call.
        log_every: iterations between two rows of metrics.
        checkpoint_every: iterations between two checkpoints.
        keep_checkpoints: newest checkpoints kept on disk.
        spread_ends: cut the first episode of each world short at a time of its own, so
            that worlds in which the hand seldom falls do not all begin again at once.
            A policy that is trained further from `--warm-start` needs it.
        video_every: iterations between two videos of the policy; 0 for none.
        loggers: where the learning curve goes beside JSON and TensorBoard: "wandb",
            "rerun", or both with a comma between; each is an extra of its own.
        on_overflow: what to do when Warp had no space for all contacts and dropped some
            of them: "stop" with what to set, or "warn" and go on; see
            `envs.physics.room`.
        hang_limit_s: shortest time without progress that counts as a hang [s].
        ppo: settings of the learner.
    """

    task: str = "crawl"
    preset: str = "paper"
    seed: int = _number(0, 0, 2**32 - 1)
    backend: str = "cpu"
    num_envs: int = _number(4096, 1, MAX_WORLDS)
    iterations: int = _number(8000, 1, MAX_ITERATIONS, free=True)
    iterations_per_call: int = _number(1, 1, MAX_ITERATIONS)
    log_every: int = _number(10, 1, MAX_ITERATIONS, free=True)
    checkpoint_every: int = _number(200, 1, MAX_ITERATIONS, free=True)
    keep_checkpoints: int = _number(3, 1, MAX_ITERATIONS, free=True)
    spread_ends: bool = False
    video_every: int = _number(0, 0, MAX_ITERATIONS, free=True)
    loggers: tuple[Literal["wandb", "rerun"], ...] = _free(())
    on_overflow: Literal["stop", "warn"] = _free("stop")
    hang_limit_s: float = _number(300.0, POSITIVE, free=True)
    ppo: PpoConfig = dataclasses.field(default_factory=PpoConfig)

    @property
    def steps_per_iteration(self) -> int:
        """Control steps of all worlds in one iteration."""
        return self.num_envs * self.ppo.unroll_length


def paper() -> TrainConfig:
    """Returns the paper's settings of a first stage: 4,096 worlds, 8,000 iterations."""
    return TrainConfig(preset="paper", num_envs=4096, iterations=8000)


def adapt() -> TrainConfig:
    """Returns the paper's settings of the second stage: 5,000 iterations.

    It is to be warm-started from the first, whose schedules go on. A warm start begins
    with new action noise; under all that `paper` begins with, a hand that has learned
    to walk stumbles and falls, so it is half of it (ours).
    """
    ppo = PpoConfig(init_noise_std=0.5)
    return TrainConfig(preset="adapt", num_envs=4096, iterations=5000, ppo=ppo)


def fast() -> TrainConfig:
    """Returns settings for one GPU: a gait within minutes.

    Less noise at the start lets the hand stand before the lift reward drives it, and
    more, smaller iterations learn faster than fewer with twice the worlds.
    """
    ppo = PpoConfig(init_noise_std=0.5, entropy_cost=0.003)
    return TrainConfig(preset="fast", num_envs=4096, iterations=3000, ppo=ppo)


def cpu() -> TrainConfig:
    """Returns small settings for a few CPU cores: learning shows within minutes.

    Small outputs and little noise at the start: the hand stands at first and learns to
    stay up within some ten iterations, instead of some hundred.
    """
    ppo = PpoConfig(
        entropy_cost=0.003,
        actor_layers=(256, 128),
        critic_layers=(256, 128),
        init_noise_std=0.4,
        init_mean_scale=SMALL_MEAN_SCALE,
    )
    return TrainConfig(
        preset="cpu",
        num_envs=256,
        iterations=150,
        log_every=2,
        checkpoint_every=25,
        ppo=ppo,
    )


PRESETS = {"paper": paper, "adapt": adapt, "fast": fast, "cpu": cpu}
STAGES = ("paper", "adapt")
"""Presets with the paper's values: its two stages of training."""
MANIPULATION_CRITIC = (256, 128, 64)
"""Hidden sizes of the value function of keyboard and pushing (paper)."""


def preset(name: str, task: str = "crawl") -> TrainConfig:
    """Returns a fresh configuration of the preset `name` for a task.

    Tasks other than crawling start with small outputs. A hand that starts far from its
    reference angles gives large and nearly constant inputs until the first iteration
    has filled the normalizer, and with weights of usual size the first updates then
    change the policy by a divergence of 100 nat, after which the rate is at its lower
    bound and nothing is learned.

    With the paper's values, keyboard and pushing have the critic that it states for
    them.

    Args:
        name: of the preset.
        task: registered name of the task.

    Raises:
        InputError: if there is no such preset.
    """
    if name not in PRESETS:
        raise InputError("preset", "", name, one_of(PRESETS, name))
    config = dataclasses.replace(PRESETS[name](), task=task)
    if task == "crawl":
        return config
    ppo = dataclasses.replace(config.ppo, init_mean_scale=SMALL_MEAN_SCALE)
    if name in STAGES and task in ("keyboard", "push"):
        ppo = dataclasses.replace(ppo, critic_layers=MANIPULATION_CRITIC)
    return dataclasses.replace(config, ppo=ppo)


def free_fields(config: Any) -> set[str]:
    """Returns the names of those fields that a resumed run may change.

    Args:
        config: settings of run or task; what is no dataclass has no such field.
    """
    if not dataclasses.is_dataclass(config):
        return set()
    return {f.name for f in dataclasses.fields(config) if "free" in f.metadata}


def bound_fields(config: TrainConfig) -> dict[str, Any]:
    """Returns those fields, as plain data, that a resumed run must share."""
    free = free_fields(config)
    return {k: v for k, v in to_dict(config).items() if k not in free}


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
    for name in ("iterations", "log_every", "checkpoint_every", "video_every"):
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
