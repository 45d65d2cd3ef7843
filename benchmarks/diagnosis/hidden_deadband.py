"""Records a finger whose servos have a deadband, in a simulator that shares no code.

    python -m benchmarks.diagnosis.hidden_deadband --out deadband

Writes `finger.parquet`, three rounds of the standard recording of a ring finger on a
stand with noise and slightly wrong nominal parameters, and `real.yaml`, the hand of
which every joint has that deadband: the stand-in for the hardware of README.md.
"""

import argparse
import dataclasses
from pathlib import Path

import numpy as np

from benchmarks.diagnosis.hidden.recording import standard
from benchmarks.diagnosis.hidden.sampling import Noise, record
from benchmarks.diagnosis.hidden.stands import make_stand, slightly_wrong
from envs.actuator.catalogue import effect_kind
from envs.hand.hand_file import Effect, load_hand_file, save_hand_file
from envs.hand.quantity import Quantity
from sysid.logs.log import MeasuredLog
from sysid.logs.read import write_log

HALF_WIDTH_RAD = 0.04
RATE_HZ, ROUND_S, ROUNDS = 200.0, 12.0, 3
SEED = 8


def main() -> None:
    """Writes both files."""
    parser = argparse.ArgumentParser(description=str(__doc__).partition("\n")[0])
    parser.add_argument("--out", type=Path, default=Path("deadband"))
    out = parser.parse_args().out
    out.mkdir(parents=True, exist_ok=True)
    write_log(finger_log(), out / "finger.parquet")
    unit = effect_kind("deadband").units()["half_width_rad"]
    width = Quantity(HALF_WIDTH_RAD, unit, "user")
    deadband = Effect("deadband", {"half_width_rad": width}, ("all",))
    hand = dataclasses.replace(load_hand_file(), effects=(deadband,))
    save_hand_file(hand, out / "real.yaml")


def finger_log() -> MeasuredLog:
    """Records the finger."""
    rng = np.random.default_rng(SEED)
    stand = make_stand("finger", rng, lowpass_hz=3.0)
    rounds = standard(rng, stand.middle, stand.reach, RATE_HZ, ROUND_S, ROUNDS)
    truth = slightly_wrong(stand.mechanism, rng)
    for joint in stand.moved:
        truth = truth.with_effect(joint, "deadband", half_width_rad=HALF_WIDTH_RAD)
    quat_w = stand.mechanism.base_quat_w
    return record(truth, rounds, Noise(), rng, palm_quat_w=quat_w, source="a stand")


if __name__ == "__main__":
    main()
