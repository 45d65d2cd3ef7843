"""What an effect is, and the signals of one substep that effects act on.

An effect is one file with one `EffectKind`. Its functions work elementwise in the
joints: the same code serves one joint of a test stand and the twenty of a hand, a
single world and a batch under `vmap`, identification and training. Effects of the
whole hand change the physics model or what the IMU measures.
"""

import enum
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import flax.struct
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from envs.actuator.surroundings import ALONE, Imu, Scene, Surroundings

Params = Mapping[str, Array]
"""Values of an effect's parameters by name, scalar or one per joint; may be traced."""


@flax.struct.dataclass
class Substep:
    """The signals of one physics substep, from target to joint and back.

    Attributes:
        command: what the servo follows [rad]; first the target.
        goal: where the command goes, before limits of its speed [rad].
        rising, falling: largest speeds of the command up and down [rad/s].
        q, qd: joint angle [rad] and speed [rad/s] of the physics.
        encoder, encoder_speed: what the servo's encoder measures [rad], [rad/s].
        error: command − encoder, as the servo weighs it [rad].
        kp, kd: gains of the servo [N·m/rad], [N·m·s/rad].
        effort: torque of the motor, measured by its current [N·m].
        follows: share of kp and kd with which the effort follows error and speed; 0
            where it is limited.
        torque: torque of the drive on the joint [N·m]: the effort behind the gears.
        damping: how fast `torque` falls with the joint's speed, ≥ 0 [N·m·s/rad]; an
            integrator takes it implicitly, for a stiff servo is unstable without.
        passive: torque of springs in parallel to the drive [N·m].
        load: torque of everything else on the joint, e.g. gravity [N·m].
        friction: largest dry friction, ≥ 0 [N·m]; see `effects.joint`.
        viscous: viscous friction, ≥ 0 [N·m·s/rad].
        inertia: inertia that the drive adds to the joint [kg·m²].
        reading: angle that reaches host and log [rad].
        around: what the rest of the hand is doing.
    """

    command: Float[Array, "*j"]
    goal: Float[Array, "*j"]
    rising: Float[Array, "*j"]
    falling: Float[Array, "*j"]
    q: Float[Array, "*j"]
    qd: Float[Array, "*j"]
    encoder: Float[Array, "*j"]
    encoder_speed: Float[Array, "*j"]
    error: Float[Array, "*j"]
    kp: Float[Array, "*j"]
    kd: Float[Array, "*j"]
    effort: Float[Array, "*j"]
    follows: Float[Array, "*j"]
    torque: Float[Array, "*j"]
    damping: Float[Array, "*j"]
    passive: Float[Array, "*j"]
    load: Float[Array, "*j"]
    friction: Float[Array, "*j"]
    viscous: Float[Array, "*j"]
    inertia: Float[Array, "*j"]
    reading: Float[Array, "*j"]
    around: Surroundings = ALONE


class Stage(enum.Enum):
    """Where in the substep an effect acts, in the order of the chain."""

    LOAD = "load"
    COMMAND = "command"
    PROFILE = "profile"
    ENCODER = "encoder"
    GAINS = "gains"
    ERROR = "error"
    TORQUE = "torque"
    TRANSMISSION = "transmission"
    FRICTION = "friction"
    INERTIA = "inertia"
    READING = "reading"


Act = Callable[[Params, Any, Substep, float], tuple[Any, Substep]]
"""(parameters, state, signals, substep [s]) -> new state, changed signals; pure."""


ChangeModel = Callable[[Params, Scene, dict[str, Array]], dict[str, Array]]
"""(parameters, scene, `MjModel` fields of a world) -> changed fields; pure."""


def lognormal(median: float, factor: float) -> "Prior":
    """A positive size: about two thirds within `factor` of the median."""
    return Prior("lognormal", median, factor)


def normal(mean: float, deviation: float) -> "Prior":
    """A size of either sign."""
    return Prior("normal", mean, deviation)


@dataclass(frozen=True)
class Prior:
    """What is believed before any measurement, in the unit of the parameter.

    Attributes:
        kind: `normal`, or `lognormal` with the median as center and a factor as spread.
        center: mean or median.
        spread: deviation or factor.
    """

    kind: str
    center: float
    spread: float

    def log_density(self, value: Float[ArrayLike, "*j"]) -> Float[Array, "*j"]:
        """Log density up to a constant: log p(x) [1].

            normal:     −z²/2,           z = (x − μ) / σ
            lognormal:  −z²/2 − log x,   z = log(x / μ) / log σ

        Args:
            value: x, in the parameter's own unit [rad, N·m, …]; > 0 if lognormal.

        Source:
            C. Bishop, Pattern Recognition and Machine Learning, 2006 (Gaussian and its
            change of variables).
        """
        value = jnp.asarray(value)
        if self.kind == "lognormal":
            z = jnp.log(value / self.center) / jnp.log(self.spread)
            return -0.5 * z**2 - jnp.log(value)
        return -0.5 * ((value - self.center) / self.spread) ** 2


@dataclass(frozen=True)
class Parameter:
    """A parameter of an effect.

    Attributes:
        unit: SI unit, "1" if it has none.
        low, high: range in which a fit searches.
        prior: what is believed before.
        identity: value at which the effect vanishes, whatever the others are; None for
            parameters that only shape it.
        source: where prior and bounds come from.
    """

    unit: str
    low: float
    high: float
    prior: Prior
    identity: float | None = None
    source: str = "ours"


def _stateless(params: Params, target: Array, q: Array, dt: float) -> tuple[()]:
    """State of an effect that remembers nothing."""
    return ()


@dataclass(frozen=True)
class EffectKind:
    """One effect of the catalogue.

    Attributes:
        name: identifier in hand files and verdicts.
        equation: what it computes, in one line.
        parameters: its parameters by name.
        acts: its functions by the stage at which the chain calls them.
        confusable_with: effects that leave like traces, each with the experiment that
            distinguishes them.
        source: literature.
        init: state at rest, from (parameters, target [rad], angle [rad], substep [s]).
        scope: what one value of its parameters holds for.
        needs: fields of `Surroundings` without which `acts` cannot be computed.
        uses_load: whether `acts` reads the load on the joint.
        changes_model: (parameters, scene, model fields) -> changed model fields, for
            effects that the physics model of the whole hand can have; there they act
            by it alone. Parameters are per finger or for the hand.
        senses: (parameters, reading of the IMU) -> changed reading.
    """

    name: str
    equation: str
    parameters: Mapping[str, Parameter]
    acts: Mapping[Stage, Act]
    confusable_with: Mapping[str, str]
    source: str
    init: Callable[[Params, Any, Any, float], Any] = field(default=_stateless)
    scope: Literal["joint", "finger", "hand"] = "joint"
    needs: tuple[str, ...] = ()
    uses_load: bool = False
    changes_model: ChangeModel | None = None
    senses: Callable[[Params, Imu], Imu] | None = None

    def identity(self) -> dict[str, float]:
        """Returns parameters at which the effect vanishes."""
        return {
            name: p.prior.center if p.identity is None else p.identity
            for name, p in self.parameters.items()
        }

    def units(self) -> dict[str, str]:
        """Returns the unit of every parameter."""
        return {name: p.unit for name, p in self.parameters.items()}
