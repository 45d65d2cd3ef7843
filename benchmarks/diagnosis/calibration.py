"""Whether the probabilities of a diagnosis are right, and the constants behind them.

    python -m benchmarks.diagnosis.calibration ROWS.jsonl --figure reliability.png
    python -m benchmarks.diagnosis.calibration ROWS.jsonl --fit OTHERS.jsonl

Of every joint in a battery's rows, how probable the most probable hypothesis was said
to be, and how often it was the truth. With `--fit` the constants are fitted to other
rows first, by their mean log score, and printed.
"""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from scipy.optimize import minimize
from scipy.stats import binomtest

from benchmarks.diagnosis.score import Row, read_rows
from sysid.diagnosis.verdict.posterior import (
    CALIBRATION,
    Calibration,
    Effects,
    named_sets,
    posterior,
)

EDGES = (0.0, 0.5, 0.7, 0.85, 0.95, 1.0)
"""Edges of the bins of a reliability diagram."""

FLOOR = 1e-3
"""Least probability of the truth in a log score: what the search never fitted."""

DRAWS = 1000
"""Number of bootstrap samples."""


@dataclass(frozen=True)
class Case:
    """What is known of one joint, and its truth; None is outside of the catalogue."""

    log_likelihoods: dict[Effects, float]
    named: set[Effects]
    left: bool
    truth: Effects | None


def cases_of(row: Row) -> list[Case]:
    """One case for every joint that a row has evidence of."""
    return [_case(row, joint) for joint in row.evidence]


def all_cases(rows: Sequence[Row]) -> list[Case]:
    """The cases of all rows but those whose diagnosis raised."""
    return [case for row in rows if row.verdict != "error" for case in cases_of(row)]


def _case(row: Row, joint: str) -> Case:
    said = {_effects(k): v for k, v in row.evidence[joint].items()}
    chosen = next(s for s, v in said.items() if v == 0.0 and set(s) <= set(row.causes))
    first = next((c for c in row.causes if c in chosen), "")
    pairs = [(a, first) for a in row.alternatives if first == row.causes[0]]
    pairs += [(a, c) for a in row.others for c in chosen if c != row.causes[0]]
    left = any(sign.startswith(f"{joint}:") for sign in row.signs)
    truth: Effects | None = tuple(sorted(row.effects))
    if joint != row.joint or row.group == "invisible":
        truth = ()
    elif row.group == "outside":
        truth = None
    return Case(said, named_sets(chosen, pairs), left, truth)


def _effects(name: str) -> Effects:
    return tuple(sorted(name.split("+"))) if name else ()


def log_score(by: Calibration, cases: Sequence[Case]) -> float:
    """Mean log probability of the truth, at least log `FLOOR` [1]."""
    said = [posterior(c.log_likelihoods, c.named, c.left, by) for c in cases]
    truth = [p.get(c.truth, 0.0) for p, c in zip(said, cases, strict=True)]
    return float(np.mean(np.log(np.maximum(truth, FLOOR))))


def fitted(cases: Sequence[Case]) -> Calibration:
    """The constants of the largest log score, from two starts."""

    def loss(x: np.ndarray) -> float:
        return -log_score(_constants(x), cases)

    x0 = [np.array([np.log(weight), 4.0, 2.0, 0.0, -4.0]) for weight in (0.5, 2.0)]
    options = {"maxiter": 4000, "xatol": 1e-3, "fatol": 1e-6}
    found = [minimize(loss, x, method="Nelder-Mead", options=options) for x in x0]
    return _constants(min(found, key=lambda f: f.fun).x)


def _constants(x: np.ndarray) -> Calibration:
    return Calibration(float(np.exp(x[0])), *x[1:].tolist())


def leading(by: Calibration, cases: Sequence[Case]) -> tuple[np.ndarray, np.ndarray]:
    """Probability of each case's most probable hypothesis, and whether it is true."""
    said = [posterior(c.log_likelihoods, c.named, c.left, by) for c in cases]
    best = [max(p, key=lambda s, p=p: p[s]) for p in said]
    sure = [p[s] for p, s in zip(said, best, strict=True)]
    right = [s == c.truth for s, c in zip(best, cases, strict=True)]
    return np.array(sure), np.array(right)


def calibration_error(sure: np.ndarray, right: np.ndarray) -> float:
    """Mean |p̄_b − r_b| over the bins b, weighted by their cases.

    Source:
        M. P. Naeini, G. F. Cooper, M. Hauskrecht, Obtaining Well Calibrated
        Probabilities Using Bayesian Binning, AAAI 2015.
    """
    bins = np.digitize(sure, EDGES[1:-1])
    gaps = [
        (bins == b).sum() * abs(sure[bins == b].mean() - right[bins == b].mean())
        for b in np.unique(bins)
    ]
    return float(np.sum(gaps) / len(sure))


def calibration_interval(sure: np.ndarray, right: np.ndarray) -> list[float]:
    """The calibration error, and its 95 % interval by the bootstrap over joints."""
    rng = np.random.default_rng(0)
    draws = rng.integers(0, len(sure), (DRAWS, len(sure)))
    errors = [calibration_error(sure[i], right[i]) for i in draws]
    return [calibration_error(sure, right), *np.percentile(errors, [2.5, 97.5])]


def main() -> None:
    """Runs from the command line."""
    parser = argparse.ArgumentParser(description=str(__doc__).partition("\n")[0])
    parser.add_argument("rows", type=Path, nargs="+")
    parser.add_argument("--fit", type=Path, nargs="+", default=[])
    parser.add_argument("--figure", type=Path)
    args = parser.parse_args()
    by = fitted(_read(args.fit)) if args.fit else CALIBRATION
    print(by)
    cases = _read(args.rows)
    sure, right = leading(by, cases)
    for line in _table(sure, right):
        print(line)
    print(f"log score {log_score(by, cases):.3f} of {len(cases)} joints")
    if args.figure:
        drawn(sure, right).savefig(args.figure, dpi=120)


def _read(paths: Sequence[Path]) -> list[Case]:
    return all_cases([row for path in paths for row in read_rows(path)])


def _table(sure: np.ndarray, right: np.ndarray) -> list[str]:
    lines = ["said        joints  mean   true"]
    bins = np.digitize(sure, EDGES[1:-1])
    for b in np.unique(bins):
        p, r = sure[bins == b], right[bins == b]
        span = f"{EDGES[b]:.2f}-{EDGES[b + 1]:.2f}"
        lines.append(f"{span:12}{len(p):5d}  {p.mean():.3f}  {r.mean():.3f}")
    error, low, high = calibration_interval(sure, right)
    return [*lines, f"calibration error {error:.3f} [{low:.3f}, {high:.3f}]"]


def drawn(sure: np.ndarray, right: np.ndarray) -> Figure:
    """Reliability diagram with exact intervals of the bins' shares."""
    figure = Figure(figsize=(4.2, 4.2), layout="constrained")
    axis = figure.subplots()
    axis.plot([0, 1], [0, 1], "--", color="#999999")
    bins = np.digitize(sure, EDGES[1:-1])
    for b in np.unique(bins):
        p, r = sure[bins == b].mean(), right[bins == b]
        inside = binomtest(int(r.sum()), len(r)).proportion_ci()
        axis.plot([p, p], [inside.low, inside.high], color="#4c72b0", lw=1)
        axis.plot(p, r.mean(), "o", color="#4c72b0")
        axis.annotate(str(len(r)), (p, r.mean()), (6, -4), textcoords="offset points")
    axis.set(xlabel="probability said", ylabel="share true", xlim=(0, 1), ylim=(0, 1))
    return figure


if __name__ == "__main__":
    main()
