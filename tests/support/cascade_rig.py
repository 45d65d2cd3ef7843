"""A joint with a velocity loop: what the hidden simulator does, and what is known."""

from dataclasses import replace

import numpy as np

from benchmarks.diagnosis.hidden.believed import believed
from benchmarks.diagnosis.hidden.conditions import Conditions
from benchmarks.diagnosis.hidden.sampling import Noise, record
from benchmarks.diagnosis.hidden.stands import make_stand
from sysid.diagnosis.diagnose import problem_of
from sysid.diagnosis.replay.track import all_tracks
from sysid.logs.log import make_log

QUIET = Noise(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0, 0.0)
"""A log that is the motion itself."""


def stand_of(seed, **changes):
    """A stand, with fields of its joint changed."""
    stand = make_stand("cascade", np.random.default_rng(seed), 15.0)
    joint = replace(stand.mechanism.joints[0], **changes)
    return replace(stand, mechanism=stand.mechanism.with_joint(0, joint))


def exact_log(stand, seed=0, round_s=6.0):
    """A record of the stand without any noise."""
    rng = np.random.default_rng(seed)
    recording = Conditions(round_s=round_s).once(rng, stand)
    return record(stand.mechanism, recording, QUIET, rng)


def problem_with(log, stand, effort=True, **drive):
    """The equations of a record, with fields of the believed drive changed."""
    known = believed(stand, effort)
    (joint,) = known.joints
    changed = replace(known.drives[joint], **drive)
    known = replace(known, drives={joint: changed})
    if not effort:
        columns = {k: x for k, x in log.columns.items() if not k.startswith("tau")}
        log = make_log(log.header.joints, log.t_s, columns)
    track = all_tracks([log], known)[0]
    return problem_of(track, [log], known, False)
