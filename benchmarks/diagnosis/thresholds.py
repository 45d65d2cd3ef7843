"""From which gain on is an effect more than chance? Effect-free records show it.

    python -m benchmarks.diagnosis.thresholds --seed 1 --records 100

Every effect is added to the simulation of effect-free records, as a search does first.
Printed are the largest gains of a record, apart for nominal parameters that the
simulation has and for effects that it lacks, and the gains that 5 % of the records
exceed.
"""

import argparse
import json
from pathlib import Path

import numpy as np

from benchmarks.diagnosis.hidden.believed import believed
from benchmarks.diagnosis.hidden.cases import draw_case
from sysid.diagnosis.diagnose import problem_of
from sysid.diagnosis.fits.candidate import fit_models, log_likelihood_gain
from sysid.diagnosis.replay.track import all_tracks
from sysid.diagnosis.search.settling import settled
from sysid.diagnosis.search.stage import extended


def largest_gains(seed: int) -> dict:
    """Returns the largest gains on one effect-free record [nat], by class."""
    case = draw_case(seed, (), "medium", ("pendulum", "joint")[seed % 2])
    mechanism = believed(case.stand)
    tracks = all_tracks(case.logs, mechanism)
    track = next(t for t in tracks if t.joint == case.joint)
    problem = problem_of(track, case.logs, mechanism, len(case.stand.moved) > 1)
    problem, base = settled(problem)
    stage = extended(problem, base)
    again = fit_models(problem, [()] * 3, [m.fit.theta for m in stage[:3]])
    base = min([base, *again], key=lambda m: m.fit.cost)
    samples = problem.samples
    best = {"nominal": (0.0, ""), "effect": (0.0, "")}
    for model in stage:
        name = model.effects[-1]
        kind = "nominal" if problem.space.has_nominal(name) else "effect"
        best[kind] = max(best[kind], (log_likelihood_gain(base, model, samples), name))
    return {"seed": seed, **best, "residual": max(base.errors.tolist())}


def main() -> None:
    """Runs from the command line."""
    parser = argparse.ArgumentParser(description=str(__doc__).partition("\n")[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--records", type=int, default=100)
    parser.add_argument("--out", type=Path, default=Path("build/thresholds.jsonl"))
    args = parser.parse_args()
    args.out.parent.mkdir(parents=True, exist_ok=True)
    rows = []
    with open(args.out, "a") as file:
        for number in range(args.records):
            rows.append(largest_gains(1000 * args.seed + number))
            file.write(json.dumps(rows[-1]) + "\n")
            file.flush()
            print(rows[-1], flush=True)
    for kind in ("nominal", "effect"):
        gains = [row[kind][0] for row in rows]
        print(
            f"{kind}: 95 % below {np.quantile(gains, 0.95):.1f}, all {max(gains):.1f}"
        )


if __name__ == "__main__":
    main()
