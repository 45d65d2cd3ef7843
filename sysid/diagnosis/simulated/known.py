"""What has been simulated of a track: no candidate is simulated twice."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from sysid.diagnosis.fits.memory import Memory
from sysid.diagnosis.fits.programs import Program


@dataclass(frozen=True, eq=False)
class Known:
    """What has been simulated of one track.

    Attributes:
        angles: of candidates, by program and whether their readings are late.
        targets: mean targets, by the parameters of their path.
    """

    angles: dict[tuple[Program, bool], Memory] = field(default_factory=dict)
    targets: Memory = field(default_factory=dict)

    def apart(self) -> "Known":
        """Returns the same, which grows for itself: for work beside other work.

        What is evaluated in which batch must not depend on which of them is ahead.
        """
        angles = {kind: dict(memory) for kind, memory in self.angles.items()}
        return Known(angles, dict(self.targets))

    def join(self, others: Sequence["Known"]) -> None:
        """Takes what others know more."""
        for other in others:
            _join(self.targets, other.targets)
            for kind, memory in other.angles.items():
                _join(self.angles.setdefault(kind, {}), memory)


def _join(memory: Memory, other: Memory) -> None:
    memory |= {key: found for key, found in other.items() if key not in memory}
