"""Promotion: the best configurations of a sweep are trained on more seeds."""

import math
from collections.abc import Mapping
from pathlib import Path

from envs.config.json_file import read_table
from envs.errors import InputError, one_of
from fingers_mjx.evaluation.direction import BETTER, STANDING, Better, better
from fingers_mjx.evaluation.files import SUMMARY_FILE
from fingers_mjx.studies.sweep.manifest import Manifest, Member
from fingers_mjx.studies.sweep.plan import Key
from fingers_mjx.studies.sweep.spec import Sweep, seed_list


def promoted(spec: Sweep, root: Path, manifest: Manifest) -> list[Key]:
    """Returns the members that promotion adds.

    Configurations are ranked by the mean, over the seeds of the sweep, of the mean over
    episodes; seeds that promotion has added do not enter, so that the choice stays.

    Args:
        spec: resolved.
        root: directory of the sweep.
        manifest: all members of its seeds are done or have diverged.

    Raises:
        InputError: the evaluation has no such measure.
    """
    if spec.promote is None:
        return []
    seeds, by = seed_list(spec.seeds), measure(spec, root)
    found: dict[str, list[float]] = {}
    for member in manifest.members:
        if member.state == "done" and member.seed in seeds:
            value = _measure(root, member, by)
            found.setdefault(member.configuration, []).append(value)
    best = _best(found, spec.promote.top, check_promotion(spec, root))
    more = seed_list(spec.promote.seeds, max(seeds))
    return [Key(name, seed) for seed in more for name in best]


def choosing(spec: Sweep | None, manifest: Manifest) -> dict[str, tuple[int, ...]]:
    """Returns, of each configuration that was promoted, the seeds that chose it.

    The best of many is chosen for its luck too: on the seeds that chose it a
    configuration looks better than it is.

    Args:
        spec: resolved; None if it is not known.
        manifest: members of the sweep.
    """
    if spec is None or spec.promote is None:
        return {}
    chose = seed_list(spec.seeds)
    more = {m.configuration for m in manifest.members if m.seed not in chose}
    return {name: chose for name in manifest.configurations if name in more}


def check_promotion(spec: Sweep, source: Path) -> Better:
    """Returns which direction of the measure is better, by which is promoted.

    Raises:
        InputError: it is neither known nor given, or promotion has a seed of the sweep.
    """
    promote = spec.promote
    if promote is None:
        return "higher"
    chose = seed_list(spec.seeds)
    if common := set(chose) & set(seed_list(promote.seeds, max(chose))):
        shown = ", ".join(map(str, sorted(common)))
        valid = "seeds other than those of the sweep"
        raise InputError(source, "promote.seeds", shown, valid)
    by = measure(spec, source)
    found = promote.better or better(spec.task, by)
    if found is None:
        raise _unknown(spec.task, source, by)
    return found


def measure(spec: Sweep, source: Path) -> str:
    """Returns the measure by which is promoted, the task's main one if not given.

    Raises:
        InputError: none is given, and the task has none.
    """
    given = spec.promote.by if spec.promote else None
    by = given or next(iter(BETTER.get(spec.task, ())), None)
    if by is None:
        raise _unknown(spec.task, source, "")
    return by


def _unknown(task: str, source: Path, by: str) -> InputError:
    known = one_of(BETTER.get(task, STANDING), by)
    valid = f"{known}; or any measure with better: higher|lower"
    return InputError(source, "promote.by", by, valid)


def _best(found: Mapping[str, list[float]], top: int, direction: Better) -> list[str]:
    """Returns the best configurations; those without a value are none of them."""
    means = {name: sum(x) / len(x) for name, x in found.items()}
    known = [name for name, mean in means.items() if math.isfinite(mean)]
    sign = -1.0 if direction == "higher" else 1.0
    return sorted(known, key=lambda name: sign * means[name])[:top]


def _measure(root: Path, member: Member, name: str) -> float:
    """Returns a measure of a member; NaN where it is undefined."""
    path = root / member.run / "eval" / SUMMARY_FILE
    measures = read_table(path).get("measures")
    if not isinstance(measures, dict) or name not in measures:
        valid = one_of(measures if isinstance(measures, dict) else (), name)
        raise InputError(root, "promote.by", name, valid)
    try:
        mean = measures[name]["mean"]
        return math.nan if mean is None else float(mean)
    except (LookupError, TypeError, ValueError) as error:
        valid = "an evaluation that fingers wrote"
        raise InputError(path, f"measures.{name}", measures[name], valid) from error
