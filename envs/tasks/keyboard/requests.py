"""Requests for keys: what the policy is asked, and how each request ends.

    idle gap ──► request of one arrow key ──► first key event or time-out ──► idle gap …

The first key event after a request decides it: correct if it is the requested key,
wrong if it is another. Without one in time the request fails (paper).
"""

import flax.struct
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int, PRNGKeyArray

from envs.config.settings.keyboard import RequestConfig as RequestConfig
from envs.streams import stream
from envs.tasks.keyboard.model import ARROWS

IDLE = -1


@flax.struct.dataclass
class Requests:
    """The request under way.

    Attributes:
        key: requested key, an index into `ARROWS`, or `IDLE`.
        steps: control steps since the request or the gap began.
        gap_steps: length of the gap [control steps].
    """

    key: Int[Array, "*b"]
    steps: Int[Array, "*b"]
    gap_steps: Int[Array, "*b"]


@flax.struct.dataclass
class Outcome:
    """What a control step meant for the request, each 0 or 1, counts for `stray`.

    Attributes:
        hit: the requested key was pressed, as the first key.
        wrong: another key was pressed first.
        timeout: the time was up.
        latency_s: from the request to its end, 0 in steps that end none [s].
        stray: key events that decide no request: of a gap, or together with a first.
    """

    hit: Float[Array, "*b"]
    wrong: Float[Array, "*b"]
    timeout: Float[Array, "*b"]
    latency_s: Float[Array, "*b"]
    stray: Float[Array, "*b"]


def begin_requests(key: PRNGKeyArray, config: RequestConfig, dt_s: float) -> Requests:
    """An episode begins with a gap or, as often, with a request.

    Were there only gaps at first, the first iteration of a training would see inputs
    that hardly ever change, and its normalizer would blow up those of the next.
    """
    asks = jax.random.bernoulli(stream(key, "asks"))
    return Requests(
        key=jnp.where(asks, _draw_key(key), IDLE).astype(jnp.int32),
        steps=jnp.zeros((), jnp.int32),
        gap_steps=_gap_steps(key, config, dt_s),
    )


def one_hot(requests: Requests) -> Float[Array, "4"]:
    """The policy's input, r_k = [k = requested key]; zeros in a gap [1].

    Source:
        Paper, keyboard pressing.
    """
    return (jnp.arange(len(ARROWS)) == requests.key).astype(jnp.float32)


def judge(
    requests: Requests,
    pressed: Bool[Array, " keys"],
    config: RequestConfig,
    dt_s: float,
) -> Outcome:
    """Outcome of a step in which n keys go down, at time t of a request.

    hit = [n = 1 ∧ it is the requested key], wrong = [n > 0 ∧ ¬hit],
    timeout = [n = 0 ∧ t ≥ T]; in a gap all are 0 and the n events are stray. Where two
    keys go down in one step and one of them is the requested key, the press is wrong:
    which came first is not known (ours).

    Args:
        requests: the request during the step.
        pressed: key-down events of the step.
        config: times.
        dt_s: control interval [s].

    Source:
        Paper, keyboard pressing (first key event or time-out decides).
    """
    asked = requests.key != IDLE
    count = jnp.sum(pressed)
    wanted = jnp.any(pressed & (jnp.arange(len(pressed)) == requests.key))
    hit = asked & wanted & (count == 1)
    wrong = asked & (count > 0) & ~hit
    due = (requests.steps + 1) * dt_s >= config.timeout_s - 1e-6
    timeout = asked & (count == 0) & due
    ended = hit | wrong | timeout
    stray = count - (hit | wrong)
    flags = (hit, wrong, timeout)
    hit, wrong, timeout = (x.astype(jnp.float32) for x in flags)
    latency_s = jnp.where(ended, (requests.steps + 1) * dt_s, 0.0)
    return Outcome(hit, wrong, timeout, latency_s, stray.astype(jnp.float32))


def next_request(
    key: PRNGKeyArray,
    requests: Requests,
    ended: Bool[Array, ""],
    config: RequestConfig,
    dt_s: float,
) -> Requests:
    """The request of the next step, k ← drawn key at the end of a gap, else k or none.

    Args:
        key: of this step's draws.
        requests: the request during the step.
        ended: whether the step decided it.
        config: times.
        dt_s: control interval [s].

    Source:
        Paper, keyboard pressing; the length of the gap is ours.
    """
    idle = requests.key == IDLE
    begins = idle & (requests.steps + 1 >= requests.gap_steps)
    changed = begins | ended
    chosen = jnp.where(begins, _draw_key(key), jnp.where(ended, IDLE, requests.key))
    gap_steps = _gap_steps(key, config, dt_s)
    return Requests(
        key=chosen.astype(jnp.int32),
        steps=jnp.where(changed, 0, requests.steps + 1),
        gap_steps=jnp.where(ended, gap_steps, requests.gap_steps),
    )


def _draw_key(key: PRNGKeyArray) -> Int[Array, ""]:
    return jax.random.randint(stream(key, "request"), (), 0, len(ARROWS))


def _gap_steps(key: PRNGKeyArray, config: RequestConfig, dt_s: float) -> Int[Array, ""]:
    low, high = config.idle_s
    gap_s = jax.random.uniform(stream(key, "gap"), (), minval=low, maxval=high)
    return jnp.maximum(1, jnp.round(gap_s / dt_s)).astype(jnp.int32)
