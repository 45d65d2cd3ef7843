"""What the servo of a candidate follows: the command path along the sent targets.

Targets are held from one message to the next. A limit of speed answers within a
message's period, so the path advances from message to message, and not by steps of
the grid. All its parts but the delays do the same at any time, so the delays may come
last:

    c(t) = path(t − T − L − d t)

with transport delay T, age of the readings L and drift d of their clock. Seen from
readings that are late, the target was sent that much later.
"""

import flax.struct
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from envs.actuator.effects.command_quantization import quantized
from sysid.diagnosis.replay.acceleration import Limits
from sysid.diagnosis.replay.target_path import WITHIN, Path, PathState

EFFECTS = (
    "transport_delay",
    "command_quantization",
    "lowpass_cutoff",
    "slew_limit",
    "directional_slew",
    "acceleration_limit",
    "sensor_latency",
    "clock_drift",
)
"""Effects that act here."""

Params = dict[str, dict[str, Float[Array, " c"]]]


@flax.struct.dataclass
class Commands:
    """What the servo follows.

    Attributes:
        path: at the steps of the grid, just before targets that arrive then [rad].
        mean: over the step that ends there [rad]; NaN where nobody asks.
        ripple: mean about a step less what a smooth curve through the path would have
            there: a servo that is read as often as targets come is always sampled at
            the same phase of their sawtooth [rad].
        ahead: how far the path still goes at the times `WITHIN` until the end of the
            step [rad]; one zero in the place of all k where nobody asks.
    """

    path: Float[Array, "t p c"]
    mean: Float[Array, "t p c"]
    ripple: Float[Array, "t p c"]
    ahead: Float[Array, "t k p c"]


def command_path(
    held: Float[Array, "t s p"],
    sent: Float[Array, "t s p"],
    params: Params,
    dt: float,
    between: bool = True,
) -> Commands:
    """Commands of candidates c at the steps of the grid: c(t) = path(t − T − L − d t).

    The path rounds targets to a grid, passes them through a low-pass and limits their
    speed and acceleration; see `envs.actuator.effects`.

    Args:
        held: the last targets before the end of every step, in their order [rad].
        sent: when they were sent before that end, negative [steps].
        params: values of the parameters by effect; effects may be missing.
        dt: step of the grid [s].
        between: whether anybody asks what is ahead within a step; else that is zero,
            and the path takes half the time.

    Returns:
        The commands [rad].

    Source:
        Ours; exact response of a first-order low-pass to held targets.
    """
    if "acceleration_limit" in params:
        # The profile takes longer than all the rest of the path.
        limit = jnp.isfinite(params["acceleration_limit"]["acceleration_rad_s2"])
        rest = {k: v for k, v in params.items() if k != "acceleration_limit"}
        path, mean, ahead = jax.lax.cond(
            jnp.any(limit),
            lambda: _walk(held, sent, params, dt, between),
            lambda: _walk(held, sent, rest, dt, between),
        )
    else:
        path, mean, ahead = _walk(held, sent, params, dt, between)
    steps = _steps_late(params, len(held), dt)
    place = jnp.arange(len(path))[:, None] - jnp.round(steps)
    place = jnp.clip(place, 0.0, len(path) - 1.0).astype(jnp.int32)
    if between:
        ahead = jnp.take_along_axis(ahead, place[:, None, None], 0)
    late = [read_late(x, steps) for x in (path, mean, _ripple(path, mean))]
    return Commands(late[0], late[1], late[2], ahead)


def paths_of(made: Commands) -> Float[Array, "k t p c"]:
    """All of the commands but the mean, one behind the other [rad]."""
    ahead = jnp.broadcast_to(
        made.ahead, (len(made.path), len(WITHIN), *made.path.shape[1:])
    )
    return jnp.stack([made.path, made.ripple, *jnp.moveaxis(ahead, 1, 0)])


def commands_of(paths: Float[Array, "c k t p"]) -> Commands:
    """The same commands again, without a mean: `paths_of`, its candidates in front."""
    path, ripple, *ahead = jnp.moveaxis(paths, 0, -1)
    return Commands(path, jnp.full_like(path, jnp.nan), ripple, jnp.stack(ahead, 1))


def _walk(
    held, sent, params: Params, dt: float, between: bool
) -> tuple[Array, Array, Array]:
    """Path, mean and what is ahead, up to whole steps of the delays."""
    grid, age = _grid(params), _age(params, dt)
    cutoff = _value(params, "lowpass_cutoff", "cutoff_hz", jnp.inf)
    path = Path(grid, cutoff, _limits(params), dt)

    def target(now: PathState, row):
        # Most targets of a step take no time in it.
        idle = jnp.all(row[2] <= 0.0)
        return jax.lax.cond(idle, lambda s, *_: s, path.behind, now, *row), None

    def step(carry, row):
        (smooth, command, rate), (targets, times) = carry, row
        begin = _begins(times, age)
        begin = begin.at[0].set(0.0)
        parts = jnp.diff(begin, axis=0, append=jnp.ones_like(begin[:1]))
        wide = jnp.broadcast_to(command, (len(WITHIN), *command.shape))
        none = jnp.zeros_like(command)
        now = PathState(smooth, command, none, wide if between else None, rate)
        now = jax.lax.scan(target, now, (targets, begin, parts))[0]
        ahead = none[None] if now.passed is None else now.command - now.passed
        return (now.smooth, now.command, now.rate), (now.command, now.total, ahead)

    first = quantized(held[0, 0][:, None], grid)
    first = jnp.broadcast_to(first, (held.shape[2], len(age)))
    rate = jnp.zeros_like(first) if "acceleration_limit" in params else None
    return jax.lax.scan(step, (first, first, rate), (held, sent))[1]


def held_command(
    held: Float[Array, "t s p"], sent: Float[Array, "t s p"], params: Params, dt: float
) -> Float[Array, "t p c"]:
    """`command_path(…).mean` without low-pass and limit of speed, much faster.

        c̄ = Σ_i w_i round(u_i),   w_i the share of the step that target u_i is held

    Args:
        held: the last targets u before the end of every step, in their order [rad].
        sent: when they were sent before that end, negative [steps].
        params: values of the parameters by effect; effects may be missing.
        dt: step of the grid [s].

    Returns:
        Mean commands of the steps [rad].

    Source:
        Ours: such a command does not depend on where it was, so no step waits for the
        one before.
    """
    grid, age = _grid(params), _age(params, dt)
    mean, begin = jnp.zeros((len(held), held.shape[2], len(age))), 0.0
    for i in range(held.shape[1]):
        # The first target has been there before, and the last is to stay.
        last = i == held.shape[1] - 1
        end = 1.0 if last else _begins(sent[:, i + 1], age)
        mean += (end - begin) * quantized(held[:, i, :, None], grid)
        begin = end
    return read_late(mean, _steps_late(params, len(held), dt))


def _value(params: Params, effect: str, name: str, absent: float) -> Float[Array, " c"]:
    """Returns a parameter of all candidates; what it is where the effect is missing."""
    count = next(x for v in params.values() for x in v.values()).shape[0]
    return params[effect][name] if effect in params else jnp.full(count, absent)


def _grid(params: Params) -> Float[Array, " c"]:
    return _value(params, "command_quantization", "step_rad", 0.0)


def _age(params: Params, dt: float) -> Float[Array, " c"]:
    """How old targets are when they act, as readings see it [steps]."""
    delay_s = _value(params, "transport_delay", "delay_s", 0.0)
    return (delay_s + _value(params, "sensor_latency", "latency_s", 0.0)) / dt


def _begins(sent: Float[Array, "*s"], age: Float[Array, " c"]) -> Float[Array, "*s c"]:
    """When within a step targets begin to count, whole steps of their age aside."""
    return jnp.clip(sent[..., None] + age % 1.0 + 1.0, 0.0, 1.0)


def _steps_late(params: Params, count: int, dt: float) -> Float[Array, "t c"]:
    """Whole steps by which the path is read later, and what the clocks drift apart."""
    drift = 1e-6 * _value(params, "clock_drift", "drift_ppm", 0.0)
    return jnp.floor(_age(params, dt)) + drift * jnp.arange(count)[:, None]


def _ripple(path: Float[Array, "t p c"], mean: Float[Array, "t p c"]):
    """Returns the means of the steps around, less those of cubics through the path."""
    wide = jnp.pad(path, [(2, 1), (0, 0), (0, 0)], "edge")
    sides, middle = wide[:-3] + wide[3:], wide[1:-2] + wide[2:-1]
    rest = mean - (13.0 * middle - sides) / 24.0
    return 0.5 * (rest + jnp.concatenate([rest[1:], rest[-1:]]))


def _limits(params: Params) -> Limits:
    """Largest speeds up and down [rad/s], and acceleration [rad/s²]."""
    both = _value(params, "slew_limit", "speed_rad_s", jnp.inf)
    up, down = (
        _value(params, "directional_slew", f"{way}_rad_s", jnp.inf)
        for way in ("up", "down")
    )
    acceleration = _value(params, "acceleration_limit", "acceleration_rad_s2", jnp.inf)
    speeds = jnp.minimum(both, up), jnp.minimum(both, down)
    return Limits(speeds, acceleration)


def read_late(
    path: Float[Array, "t p c"], steps: Float[Array, "t c"]
) -> Float[Array, "t p c"]:
    """Reads a path some steps earlier: on straight lines between its samples."""
    last = len(path) - 1.0
    place = jnp.clip(jnp.arange(len(path))[:, None] - steps, 0.0, last)
    low = jnp.clip(jnp.floor(place), 0.0, last - 1.0).astype(jnp.int32)
    part = (place - low)[:, None]
    before = jnp.take_along_axis(path, low[:, None], 0)
    after = jnp.take_along_axis(path, low[:, None] + 1, 0)
    return (1.0 - part) * before + part * after
