"""Names what the simulation of a mechanism lacks, from records of the mechanism.

diagnosis = diagnose([read_log("knee.csv")], hand_mechanism(), seed=0)
print(diagnosis.to_json())
"""

from collections.abc import Sequence

from sysid.data import MeasuredLog
from sysid.diagnosis import Diagnosis
from sysid.mechanism import Mechanism


def diagnose(
    logs: Sequence[MeasuredLog], mechanism: Mechanism, seed: int = 0
) -> Diagnosis:
    """Compares records with the simulation and names the cause of the difference.

    Args:
        logs: records of the same mechanism; different gains, loads or days in records
            of their own.
        mechanism: the simulation as it stands.
        seed: of everything random.

    Raises:
        InputError: records that cannot be used, in one sentence.
    """
    raise NotImplementedError
