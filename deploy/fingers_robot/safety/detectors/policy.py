"""S4 bad target, S10 command lost, S11 lease missed, S12 policy gone, S18 partial.

The lease: every control step issues a challenge, and only its complement renews the
lease, from the time at which that challenge was issued. A wrong or old answer renews
nothing (Spot's E-stop works the same way), and neither does a second answer to the same
challenge. Targets pass only with an answer that renews: once per control step, however
often the policy answers.
"""

import math
from dataclasses import dataclass

import numpy as np

from fingers_robot.reading import JOINT_COUNT, Array
from fingers_robot.safety.limits import Limits, outside
from fingers_robot.safety.types import Found, Inputs, PolicyFault, Proposal

_MASK = 2**64 - 1
_KEPT = 4  # challenges that may still be answered
_MAX_STEPS = 4  # control steps of motion that a late proposal may carry


@dataclass(frozen=True, slots=True)
class LeaseMemory:
    """The lease.

    Attributes:
        challenge: the newest challenge.
        issued: the challenges that may be answered, when each was issued [s], and for
            which control step.
        renewed_s: issue time of the newest challenge that was answered rightly [s].
        tick: control step up to which the targets on the wire have followed.
        answered: control step of that challenge.
        fresh: it was answered now.
    """

    challenge: int = 0x9E3779B97F4A7C15
    issued: tuple[tuple[int, float, int], ...] = ()
    renewed_s: float = -np.inf
    tick: int = -1
    answered: int = -1
    fresh: bool = False


def complement(challenge: int) -> int:
    """The only right answer to a challenge."""
    return challenge ^ _MASK


def renew_lease(memory: LeaseMemory, inputs: Inputs, t: float) -> LeaseMemory:
    """Takes an answer, and issues the next challenge where a control step begins."""
    challenge, issued, renewed = memory.challenge, memory.issued, memory.renewed_s
    proposal, answered, fresh = inputs.proposal, memory.answered, False
    if proposal is not None:
        asked = proposal.response ^ _MASK
        place = next((k for k, x in enumerate(issued) if x[0] == asked), None)
        if place is not None:
            _, renewed, answered = issued[place]
            fresh = True
            # This one and those before it are used up.
            issued = issued[place + 1 :]
    if inputs.control_tick >= 0:
        # A linear congruential generator (Knuth's MMIX): never the same twice.
        challenge = (challenge * 6364136223846793005 + 1442695040888963407) & _MASK
        issued = (*issued[1 - _KEPT :], (challenge, t, inputs.control_tick))
    return LeaseMemory(challenge, issued, renewed, memory.tick, answered, fresh)


def detect_policy(
    memory: LeaseMemory, inputs: Inputs, target_rad: Array, t: float, limits: Limits
) -> Found:
    """Looks at the policy's answer and at the lease; arguments as `detect_sensors`."""
    found: Found = {}
    if not inputs.link_open:
        found["S12"] = "the link to the policy is closed"
    elif t - memory.renewed_s > limits.lease_s:
        found["S11"] = f"lease {_age(t - memory.renewed_s)}"
    proposal = inputs.proposal
    if proposal is not None:
        # Written so that NaN counts as lost.
        if not proposal.command_age_s <= limits.command_s:
            found["S10"] = f"command {proposal.command_age_s:.2f} s old"
        _check_target(memory, proposal, target_rad, limits, found)
    return found


def steps_behind(change_rad: Array, limits: Limits) -> int:
    """Control steps of motion that remain after one step of α toward a proposal.

    A late policy answers twice at once; what the first answer asked for comes in the
    second one, and the targets catch up in the next steps of the loop. So there is one
    step of α per control step, never more.
    """
    farthest = float(np.abs(change_rad).max()) - limits.step_tolerance_rad
    return max(math.ceil(farthest / limits.step_rad) - 1, 0)


def _check_target(
    memory: LeaseMemory,
    proposal: Proposal,
    target_rad: Array,
    limits: Limits,
    found: Found,
) -> None:
    proposed = proposal.target_rad
    if proposed.shape != (JOINT_COUNT,):
        found["S18"] = f"proposal of {proposed.size} joints"
        return
    # An answer that renews nothing moves nothing, wherever it is.
    steps = math.inf
    if memory.fresh:
        steps = min(max(memory.answered - memory.tick, 1), _MAX_STEPS)
    step = np.abs(proposed - target_rad).max()
    beyond, before = (outside(x, limits.trained_rad) for x in (proposed, target_rad))
    if proposal.fault == PolicyFault.OUTPUT:
        found["S4"] = "policy output not finite"
    elif not np.isfinite(step):
        found["S4"] = "proposed target not finite"
    elif step > steps * limits.step_rad + limits.step_tolerance_rad:
        found["S4"] = f"proposed step of {step:.3f} rad"
    elif (beyond > np.maximum(before, limits.target_margin_rad)).any():
        # Where a hand is armed that leans on its stops, the targets begin outside.
        words = f"{beyond.max():.3f} rad outside the trained limits"
        found["S4"] = f"proposed target {words}"


def _age(age_s: float) -> str:
    return "never granted" if np.isinf(age_s) else f"{1e3 * age_s:.0f} ms old"
