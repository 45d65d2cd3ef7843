"""Names what the simulation of a mechanism lacks, from records of the mechanism.

    diagnosis = diagnose([read_log("knee.csv")], hand_mechanism(), seed=0)
    print(diagnosis.to_json())

Every joint is searched for itself (`sysid.diagnosis.search.search`); effects that
several joints share are reported once, with where they act.
"""

import time
from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from threadpoolctl import threadpool_limits

from envs.errors import InputError
from sysid.diagnosis.fits.problem import Problem, make_problem
from sysid.diagnosis.fits.space import make_space
from sysid.diagnosis.measured.in_time import Age
from sysid.diagnosis.replay.motion import JointTrack
from sysid.diagnosis.replay.track import all_tracks
from sysid.diagnosis.search.by_angle import nearest
from sysid.diagnosis.search.search import Examined, search
from sysid.diagnosis.side_by_side import side_by_side
from sysid.diagnosis.simulated.output_error import OutputProblem
from sysid.diagnosis.verdict.verdict import verdict_of
from sysid.logs.log import MeasuredLog
from sysid.mechanism import Mechanism
from sysid.result import Diagnosis


def diagnose(
    logs: Sequence[MeasuredLog], mechanism: Mechanism, seed: int = 0
) -> Diagnosis:
    """Compares records with the simulation and names the cause of the difference.

    Args:
        logs: records of the same mechanism; different gains, loads or days in records
            of their own.
        mechanism: the nominal simulation.
        seed: of everything random.

    Raises:
        InputError: records that cannot be used, in one sentence.
    """
    return examine(logs, mechanism, seed)[0]


def examine(
    logs: Sequence[MeasuredLog], mechanism: Mechanism, seed: int = 0
) -> tuple[Diagnosis, list[Examined]]:
    """Does the same and also returns what was done with every joint."""
    started = time.monotonic()
    if not logs:
        raise InputError("logs", "", "no record", "at least one")
    tracks = all_tracks(logs, mechanism)
    # Joints fill the cores. BLAS threads for 25 columns wait for each other: a step of
    # a fit took 17 ms instead of 0.2 beside other work.
    with threadpool_limits(1, "blas"):
        joints = [partial(_examined, t, logs, mechanism) for t in tracks]
        examined = beside_late(side_by_side(joints), logs, mechanism)
        found = verdict_of(examined, mechanism, seed)
    found = replace(
        found,
        log_sha256=tuple(log.sha256 for log in logs),
        runtime_s=round(time.monotonic() - started, 3),
    )
    return found, examined


def beside_late(
    examined: Sequence[Examined], logs: Sequence[MeasuredLog], mechanism: Mechanism
) -> list[Examined]:
    """Examines joints again beside those whose readings were found to be late.

    What is a late reading and what a late target the joint beside it knows best: it
    stays as it was examined first unless less of its motion is left with the other in
    time.

    Args:
        examined: every joint for itself.
        logs: the records.
        mechanism: the nominal simulation.
    """
    late = {e.track.joint: a for e in examined for a in [age_of(e)] if a}
    beside = [e.search is not None and e.track.joint not in late for e in examined]
    if not late or not any(beside):
        return list(examined)
    tracks = all_tracks(logs, mechanism, late)
    some = [t for t, counts in zip(tracks, beside, strict=True) if counts]
    again = side_by_side([partial(_examined, t, logs, mechanism) for t in some])
    found = {e.track.joint: e for e in again}
    return [_nearer(e, found.get(e.track.joint, e)) for e in examined]


def age_of(examined: Examined) -> Age | None:
    """Returns how late a joint's readings are, if that is one of its causes."""
    found = examined.search
    if found is None or not {"sensor_latency", "clock_drift"} & {*found.best.effects}:
        return None
    values, _ = found.problem.space.values(found.best.fit.theta[None])
    drift_ppm = float(values["clock_drift"]["drift_ppm"][0])
    return Age(float(values["sensor_latency"]["latency_s"][0]), 1e-6 * drift_ppm)


def _nearer(first: Examined, again: Examined) -> Examined:
    """Chooses the examination that leaves less of the motion."""
    return min(first, again, key=_left)


def _left(examined: Examined) -> float:
    """Returns what a joint's best model leaves, Σ r²; all where it was not examined.

    Of the angle, where it can be simulated: one search may be by it, and one not.
    """
    found = examined.search
    if found is None:
        return np.inf
    best = nearest(found.judge, found.best)
    raw = found.judge.output.raw(best.fit.theta[None], weigh=False)
    return float(np.sum(raw**2))


def _examined(
    track: JointTrack, logs: Sequence[MeasuredLog], mechanism: Mechanism
) -> Examined:
    """Searches one joint, if it moved."""
    seen = [track.track.cmd]
    if mechanism.drives[track.joint].known == "controller":
        seen.append(track.track.pos)  # pulled by unknown forces
    moved = any(np.ptp(np.asarray(x)) > 0.0 for x in seen)
    pushed = bool(np.any(np.asarray(track.track.ext)))
    if not (moved or pushed) or not np.any(track.valid):
        return Examined(track, None, None)
    problem = problem_of(track, logs, mechanism, track.other != track.joint)
    if not problem.valid.any():  # it only moves where the rows cannot follow
        return Examined(track, None, None)
    result = search(problem)
    decided = result.problem
    equations = decided.equations if isinstance(decided, OutputProblem) else decided
    return Examined(decided.data, equations, result)


def problem_of(
    track: JointTrack, logs: Sequence[MeasuredLog], mechanism: Mechanism, company: bool
) -> Problem:
    """Makes the problem of a joint.

    Args:
        track: its measured motion.
        logs: the records.
        mechanism: the nominal simulation.
        company: whether another joint, which may pull on it, moves too.
    """
    drive = mechanism.drives[track.joint]
    known = {"others_nm": True, "gravity": True, "other_q": company}
    known["other_nm"] = known["other_q"]
    return make_problem(track, make_space(track, drive, known), logs, drive.known)
