"""From logs and an MJCF file to a first `drive.yaml`.

    proposals = describe([read_log("knee.csv")], load_mjcf("knee.xml"))
    print(drive_text(proposals, "knee.csv"))

Gains are read off the record that is to be diagnosed with them, so they are free: where
a fit begins, and no knowledge. What the owner of a robot knows is better.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from sysid.description.effort import effort_column
from sysid.description.proposal import Proposal, proposal
from sysid.description.stretches import stretches_of
from sysid.diagnosis.replay.track import measured_pieces
from sysid.drive import JointDrive, Nominal
from sysid.logs.log import MeasuredLog
from sysid.mechanism import model_mechanism
from sysid.mjcf.actuators import actuator_gains


def describe(
    logs: Sequence[MeasuredLog], model: Any, source: str | Path = "MJCF"
) -> list[Proposal]:
    """Proposes the drives of all joints of some records.

    Args:
        logs: records of the same mechanism.
        model: compiled MJCF file.
        source: of the model, for messages.

    Raises:
        InputError: joints that the model lacks, records that cannot be used, an effort
            or an angle against the direction of the targets.
    """
    joints = logs[0].header.joints
    columns = {joint: effort_column(logs, joint) for joint in joints}
    nothing = Nominal(1.0, free=True)
    drives = {j: JointDrive(nothing, nothing, effort=columns[j][0]) for j in joints}
    mechanism = model_mechanism(model, drives, source)
    pieces, bodies, _ = measured_pieces(logs, mechanism)
    return [
        proposal(
            joint,
            stretches_of(logs, pieces, bodies, j),
            columns[joint],
            float(np.median([p.row_s for p in pieces])),
            logs[0].source,
            actuator_gains(model, joint),
        )
        for j, joint in enumerate(joints)
    ]
