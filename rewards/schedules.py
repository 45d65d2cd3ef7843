"""Weights that change with the number of control steps of an environment.

A schedule is a pytree of numbers: as a traced argument it can be changed, or swept with
`vmap`, without recompiling. `steps` counts the control steps that the environment has
completed since training began, over all its episodes: 0 in the first one.
"""

import flax.struct
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from rewards.shaping import Number

Steps = int | Int[Array, ""]


@flax.struct.dataclass
class Constant:
    """The same weight at all times.

    Attributes:
        value: the weight.
    """

    value: Number

    def __call__(self, steps: Steps) -> Float[Array, ""]:
        """Weight after `steps` control steps."""
        del steps
        return jnp.asarray(self.value)


@flax.struct.dataclass
class StepSwitch:
    """One weight before `at_steps`, another from then on.

    Attributes:
        before: weight while steps < `at_steps`.
        after: weight once steps ≥ `at_steps`.
        at_steps: when it switches.
    """

    before: Number
    after: Number
    at_steps: Number

    def __call__(self, steps: Steps) -> Float[Array, ""]:
        """Weight after `steps` control steps."""
        return jnp.where(steps < self.at_steps, self.before, self.after)


@flax.struct.dataclass
class GeometricDecay:
    """Constant, then geometric, then constant: start · ratio^u.

    u = clip((steps − hold_steps)/decay_steps, 0, 1). With a ratio in the place of an
    end value, scaling `start` scales the whole curve, and `start` may be 0.

    Attributes:
        start: weight until `hold_steps`.
        ratio: final weight divided by `start`, > 0.
        hold_steps: when the change begins.
        decay_steps: how long it takes, > 0.

    Examples:
        >>> weight = GeometricDecay(-1.0, ratio=0.1, hold_steps=1000, decay_steps=2000)
        >>> [f"{weight(steps):.3f}" for steps in (0, 2000, 9000)]
        ['-1.000', '-0.316', '-0.100']
    """

    start: Number
    ratio: Number
    hold_steps: Number
    decay_steps: Number

    def __call__(self, steps: Steps) -> Float[Array, ""]:
        """Weight after `steps` control steps."""
        u = jnp.clip((steps - self.hold_steps) / self.decay_steps, 0.0, 1.0)
        return self.start * jnp.power(self.ratio, u)


Schedule = Constant | StepSwitch | GeometricDecay
