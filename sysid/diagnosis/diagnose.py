"""Names what the simulation of a mechanism lacks, from records of the mechanism.

    diagnosis = diagnose([read_log("knee.csv")], hand_mechanism(), seed=0)
    print(diagnosis.to_json())

Every joint is searched for itself (`sysid.diagnosis.search.search`); effects that
several joints share are reported once, with where they act.
"""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from threadpoolctl import threadpool_limits

from envs.errors import InputError
from sysid.diagnosis.fits.candidate import Model
from sysid.diagnosis.fits.problem import Problem, make_problem
from sysid.diagnosis.fits.space import make_space
from sysid.diagnosis.measured.in_time import Sensor
from sysid.diagnosis.replay.motion import JointTrack
from sysid.diagnosis.replay.track import all_tracks
from sysid.diagnosis.search.search import Examined, search
from sysid.diagnosis.search.shown_beside import (
    left,
    solved,
    suspected,
    unsolved_beside,
    with_cause,
)
from sysid.diagnosis.side_by_side import side_by_side
from sysid.diagnosis.simulated.ahead import compiled_ahead
from sysid.diagnosis.simulated.output_error import OutputProblem
from sysid.diagnosis.verdict.verdict import verdict_of
from sysid.logs.log import MeasuredLog
from sysid.mechanism import Mechanism
from sysid.result import Diagnosis

MISREAD = {"sensor_latency", "clock_drift", "encoder_scale"}
"""Effects by which a joint stands elsewhere than it was read."""


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
        examined = beside_misread(side_by_side(joints), logs, mechanism)
        found = verdict_of(examined, mechanism, seed)
    found = replace(
        found,
        log_sha256=tuple(log.sha256 for log in logs),
        runtime_s=round(time.monotonic() - started, 3),
    )
    return found, examined


def beside_misread(
    examined: Sequence[Examined], logs: Sequence[MeasuredLog], mechanism: Mechanism
) -> list[Examined]:
    """Examines joints again beside those that stand elsewhere than they were read.

    What is a late reading and what a late target the joint beside it knows best: it
    stays as it was examined first unless less of its motion is left with the other in
    time. And a scale of an encoder of which its own joint shows too little is named if
    that explains the motion of another one.

    Args:
        examined: every joint for itself.
        logs: the records.
        mechanism: the nominal simulation.
    """
    known = {e.track.joint: s for e in examined for s in [sensor_of(e)] if s}
    examined = list(examined)
    again = _again(examined, known, logs, mechanism, lambda e: True)
    examined = [_nearer(e, again.get(e.track.joint, e)) for e in examined]
    for k, one in enumerate(examined):
        model = suspected(one.search) if one.search else None
        if model is None:
            continue
        sensors = {**known, one.track.joint: _sensor(one.found.problem, model)}
        again = _again(examined, sensors, logs, mechanism, _unsolved)
        before = {e.track.joint: e for e in examined}
        fresh = {
            j: e
            for j, e in again.items()
            if e.search and solved(before[j].found, e.search)
        }
        if fresh:
            examined[k] = replace(one, search=with_cause(one.found, model))
            examined = [fresh.get(e.track.joint, e) for e in examined]
            known = sensors
    return examined


def _again(
    examined: Sequence[Examined],
    sensors: Mapping[str, Sensor],
    logs: Sequence[MeasuredLog],
    mechanism: Mechanism,
    asked: Callable[[Examined], bool],
) -> dict[str, Examined]:
    """Examines again what is asked for beside joints that have such sensors."""
    beside = [
        e.search is not None and e.track.joint not in sensors and asked(e)
        for e in examined
    ]
    if not sensors or not any(beside):
        return {}
    tracks = all_tracks(logs, mechanism, sensors)
    some = [t for t, counts in zip(tracks, beside, strict=True) if counts]
    again = side_by_side([partial(_examined, t, logs, mechanism) for t in some])
    return {e.track.joint: e for e in again}


def _unsolved(examined: Examined) -> bool:
    return unsolved_beside(examined.found)


def sensor_of(examined: Examined) -> Sensor | None:
    """Returns how a joint's sensor reads, if that is one of its causes."""
    found = examined.search
    if found is None or not MISREAD & {*found.best.effects}:
        return None
    return _sensor(found.problem, found.best)


def _sensor(problem: Problem, model: Model) -> Sensor:
    """Returns how a sensor reads by a model."""
    values, _ = problem.space.values(model.fit.theta[None])
    return Sensor(
        float(values["sensor_latency"]["latency_s"][0]),
        1e-6 * float(values["clock_drift"]["drift_ppm"][0]),
        float(values["encoder_scale"]["scale"][0]),
    )


def _nearer(first: Examined, again: Examined) -> Examined:
    """Chooses the examination that leaves less of the motion."""
    return min(first, again, key=lambda e: left(e.search) if e.search else np.inf)


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
    with compiled_ahead(problem):
        result = search(problem)
    problem.evaluated.forget()
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
