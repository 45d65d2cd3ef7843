"""`fingers hand import`: a hand file from a user's own MJCF."""

import argparse
from dataclasses import dataclass, field

from envs.config.atomic_file import write_atomic
from envs.config.typed import load_yaml
from envs.errors import InputError
from envs.hand.hand_file import HandFile, hand_yaml
from envs.hand.importing.figures import import_hand
from envs.hand.stance import stance_of
from fingers_mjx.cli.paths import check_file

_TURN = {"low": -1.0, "high": 1.0}


@dataclass(frozen=True)
class JointMap:
    """How a user's model says what ours does.

    Attributes:
        joints: our joint name -> the model's, for those that differ.
        palm_quat: our palm frame, back of the hand at -x and fingers at +z, in the
            model's palm body, w x y z; found by the finger bases if not given.
    """

    joints: dict[str, str] = field(default_factory=dict)
    palm_quat: tuple[float, float, float, float] | None = field(
        default=None, metadata=_TURN
    )

    def __post_init__(self) -> None:
        if self.palm_quat and abs(sum(x * x for x in self.palm_quat) - 1.0) > 1e-3:
            valid = "w x y z of length 1"
            raise InputError("joint map", "palm_quat", self.palm_quat, valid)


def run(args: argparse.Namespace) -> int:
    """Imports, says what was filled in, and writes the hand file."""
    check_file("--out", args.out)
    given = load_yaml(JointMap, args.joint_map) if args.joint_map else JointMap()
    found = import_hand(args.mjcf, given.joints, given.palm_quat)
    for sentence in found.told:
        print(sentence)
    print(_standing(found.hand))
    args.out.parent.mkdir(parents=True, exist_ok=True)
    write_atomic(args.out, hand_yaml(found.hand))
    print(f"wrote {args.out}")
    return 0


def _standing(hand: HandFile) -> str:
    try:
        height = 1000 * stance_of(hand).root_pos_w[2]
    except InputError as error:
        return f"does not stand under the stored joint targets: {error.found}"
    return f"stands under the stored joint targets, the palm {height:.1f} mm up"
