"""Times a diagnosis: one joint alone, and all twenty joints of a hand.

    python -m benchmarks.diagnosis.speed --kinds pendulum hand

Records come from the other simulator, with backlash in one joint: 30 s at 500 Hz of a
pendulum, 60 s of it at 1 kHz (`long`), the same without the effort (`angle`), and 60 s
of the hand at 200 Hz. Each is diagnosed twice; the first time also compiles. Seconds of
wall clock and of CPU are printed.
"""

import argparse
import time

import numpy as np

from benchmarks.diagnosis.hidden.believed import believed
from benchmarks.diagnosis.hidden.recording import standard
from benchmarks.diagnosis.hidden.sampling import Noise, record
from benchmarks.diagnosis.hidden.scaling import logged
from benchmarks.diagnosis.hidden.stands import make_stand, slightly_wrong
from sysid.diagnosis.diagnose import diagnose
from sysid.diagnosis.whole_loops import compile_loops_whole

RECORDS = {
    "pendulum": ("pendulum", 500.0, 10.0, True),
    "long": ("pendulum", 1000.0, 20.0, True),
    "angle": ("pendulum", 1000.0, 20.0, False),
    "hand": ("hand", 200.0, 20.0, True),
}
"""Stand, rows in a second, length of a round [s], and whether the effort is logged.
Each has three rounds."""

GAP_RAD = 0.02


def main() -> None:
    """Runs from the command line."""
    compile_loops_whole()  # as the command does
    parser = argparse.ArgumentParser(description=str(__doc__).partition("\n")[0])
    parser.add_argument("--kinds", nargs="+", choices=RECORDS, default=list(RECORDS))
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    for kind in args.kinds:
        log, mechanism = made(kind, args.seed)
        for time_of in ("first", "second"):
            wall, cpu = time.perf_counter(), time.process_time()
            said = diagnose([log], mechanism)
            wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
            causes = ", ".join(f"{c.effect} in {c.where}" for c in said.causes)
            print(
                f"{kind}, {time_of} time: {wall:.0f} s, {cpu:.0f} s of CPU; "
                f"{said.verdict}: {causes}",
                flush=True,
            )


def made(kind: str, seed: int):
    """Returns the record and what is believed."""
    rng = np.random.default_rng([seed, 3])
    rig, rate_hz, round_s, effort = RECORDS[kind]
    stand = make_stand(rig, rng)
    rounds = standard(rng, stand.middle, stand.reach, rate_hz, round_s, 3)
    truth = slightly_wrong(stand.mechanism, rng)
    truth = truth.with_effect(stand.moved[-1], "backlash", gap_rad=GAP_RAD)
    quat_w = stand.mechanism.base_quat_w
    log = record(truth, rounds, Noise(), rng, palm_quat_w=quat_w, source=kind)
    log = log if effort else logged(log, 1.0, effort)
    return log, believed(stand, effort)


if __name__ == "__main__":
    main()
