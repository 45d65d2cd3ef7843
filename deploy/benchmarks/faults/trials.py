"""One fault, many times, at random phases of the gait: what is measured of each."""

import copy
from dataclasses import dataclass

import numpy as np
from faults.lab import Lab
from faults.scenarios import Scenario

from fingers_robot.safety import Mode

WATCHED_S = 0.3


@dataclass(frozen=True)
class Trial:
    """What one trial showed.

    Attributes:
        reaction_s: fault to reaction on the wire; infinite if none came.
        end: mode at the end of the trial.
        row: the first fault that was latched.
        jump_rad: largest change between two targets that were sent in a row.
        after_disable: targets that were sent after power was switched off.
        valid: all targets were finite and within the limits.
        error: an exception, if there was one.
    """

    reaction_s: float
    end: Mode
    row: str
    jump_rad: float
    after_disable: int
    valid: bool
    error: str = ""


def run_trial(start: Lab, scenario: Scenario, seed: int) -> Trial:
    """Puts the fault into a copy of a running lab, and watches."""
    lab, rng = copy.deepcopy(start), np.random.default_rng(seed)
    try:
        lab.run(rng.uniform(0.0, 0.02))
        lab.forget()
        t0 = lab.clock.t
        begun = scenario.install(lab, rng)
        t0 = t0 if begun is None else begun
        while abs(lab.clock.t - t0) < scenario.ends_s and not _over(lab):
            lab.tick()
    except Exception as error:
        return Trial(np.inf, lab.mode, "", np.inf, -1, False, repr(error))
    return _judge(lab, t0)


def _over(lab: Lab) -> bool:
    """Power has been off for long enough to see that nothing is sent any more."""
    when, mode = lab.modes[-1] if lab.modes else (0.0, Mode.ACTIVE)
    return mode == Mode.SAFE and lab.clock.t - when > WATCHED_S


def _judge(lab: Lab, t0: float) -> Trial:
    left = [t for t, mode in lab.modes if mode != Mode.ACTIVE]
    targets = np.array([target for _, target in lab.driver.written])
    off = [t for t, on in lab.driver.powered if not on]
    late = [t for t, _ in lab.driver.written if off and t > off[0]]
    jump, valid = 0.0, True
    if len(targets):
        low, high = lab.core.limits.allowed_rad.T
        inside = (targets >= low - 1e-9) & (targets <= high + 1e-9)
        valid = bool(np.isfinite(targets).all() and inside.all())
        jump = (
            float(np.abs(np.diff(targets, axis=0)).max()) if len(targets) > 1 else 0.0
        )
    faults = lab.core.state.faults
    row = " ".join(f.id for f in faults)
    reaction = abs(left[0] - t0) if left else np.inf
    return Trial(reaction, lab.mode, row, jump, len(late), valid)


def passes(trial: Trial, scenario: Scenario, step_rad: float, period_s: float) -> bool:
    """Whether a trial is as the table says."""
    named = scenario.row in trial.row.split() or scenario.row == "S19"
    return (
        not trial.error
        and named
        and trial.reaction_s <= scenario.within_s + period_s + 1e-9
        and trial.end == scenario.ends
        and trial.jump_rad <= step_rad + 1e-9
        and trial.after_disable == 0
        and trial.valid
    )
