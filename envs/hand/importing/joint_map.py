"""Which joints of a user's model form which finger, and what the model does not say."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from envs.config.typed import limits
from envs.errors import InputError, one_of
from envs.hand.nominal import FINGERS, MOST_LINKS, link_names, vendor_hand

_POSITIVE = 1e-6


@dataclass(frozen=True)
class DriveMap:
    """Numbers of all joints in the place of the model's, which may lack them.

    Attributes:
        kp, kv: gains of the position servos.
        force_limit: their torque limit.
        armature: reflected rotor inertia.
        speed_limit: of the filtered command, of which MJCF says nothing.
    """

    kp: float | None = field(default=None, metadata=limits("N·m/rad", _POSITIVE, 1e4))
    kv: float | None = field(default=None, metadata=limits("N·m·s/rad", _POSITIVE, 1e4))
    force_limit: float | None = field(
        default=None, metadata=limits("N·m", _POSITIVE, 1e3)
    )
    armature: float | None = field(default=None, metadata=limits("kg·m²", 0.0, 1.0))
    speed_limit: float | None = field(
        default=None, metadata=limits("rad/s", 0.01, 100.0)
    )


@dataclass(frozen=True)
class JointMap:
    """How a user's model names what ours does.

    Attributes:
        joints: our joint name -> the model's, for those that differ, of a hand that is
            built as the vendor's.
        fingers: the model's joints of each finger, palm to tip, of any other hand: the
            first of thumb, index, middle, ring, little.
        palm_quat: our palm frame, back of the hand at -x and fingers at +z, in the
            model's palm body, w x y z; found by the finger bases if not given.
        drive: numbers of a hand with `fingers` that its model lacks.
    """

    joints: dict[str, str] = field(default_factory=dict)
    fingers: dict[str, tuple[str, ...]] = field(default_factory=dict)
    palm_quat: tuple[float, float, float, float] | None = field(
        default=None, metadata={"low": -1.0, "high": 1.0}
    )
    drive: DriveMap = field(default_factory=DriveMap)

    def __post_init__(self) -> None:
        if self.palm_quat and abs(sum(x * x for x in self.palm_quat) - 1.0) > 1e-3:
            valid = "w x y z of length 1"
            raise InputError("joint map", "palm_quat", self.palm_quat, valid)
        if self.fingers:
            _check_fingers(self.fingers)
        if self.fingers and self.joints:
            valid = "nothing: fingers names all joints"
            raise InputError("joint map", "joints", "joints", valid)
        if self.drive != DriveMap() and not self.fingers:
            valid = "nothing, or fingers too: what lacks is the vendor's without them"
            raise InputError("joint map", "drive", "numbers", valid)

    @property
    def links_per_finger(self) -> int:
        """Joints of each finger."""
        return len(next(iter(self.fingers.values()), vendor_hand().links[:4]))

    @property
    def names(self) -> tuple[str, ...]:
        """The model's names of all joints, finger by finger.

        Raises:
            InputError: a joint that is none of ours, or one named twice.
        """
        if self.fingers:
            order = FINGERS[: len(self.fingers)]
            theirs = tuple(name for f in order for name in self.fingers[f])
        else:
            theirs = _renamed(self.joints)
        twice = sorted({name for name in theirs if theirs.count(name) > 1})
        if twice:
            valid = f"{len(theirs)} different joints"
            raise InputError("joint_map", "", f"{twice[0]} twice", valid)
        return theirs

    @property
    def own_names(self) -> tuple[tuple[str, str], ...]:
        """Our names of links and joints, in the same order."""
        return link_names(
            len(self.names) // self.links_per_finger, self.links_per_finger
        )


def _renamed(joints: Mapping[str, str]) -> tuple[str, ...]:
    """The model's names of the joints of a hand built as the vendor's."""
    ours = vendor_hand().joint_names
    for name in joints:
        if name not in ours:
            raise InputError("joint_map", str(name), name, one_of(ours, str(name)))
    return tuple(str(joints.get(name, name)) for name in ours)


def _check_fingers(fingers: Mapping[str, tuple[str, ...]]) -> None:
    """Refuses other names than the first of ours, and fingers of unequal length."""
    wanted = FINGERS[: max(len(fingers), 3)]
    if set(fingers) != set(wanted):
        valid = "3 to 5 fingers, the first of " + ", ".join(FINGERS)
        raise InputError("joint map", "fingers", ", ".join(fingers), valid)
    counts = {len(names) for names in fingers.values()}
    if len(counts) > 1 or not 2 <= min(counts) <= MOST_LINKS:
        valid = f"equally many joints each, 2 to {MOST_LINKS}"
        found = f"{sorted(counts)} joints"
        raise InputError("joint map", "fingers", found, valid)
