"""The evidence for every set of effects that a search fitted to one joint."""

from sysid.diagnosis.fits.candidate import Model
from sysid.diagnosis.search.search import Search


def evidence(found: Search) -> dict[tuple[str, ...], float]:
    """Log predictive likelihoods of sets of effects, less that of the chosen one.

        ℓ(M) − ℓ(M*) = −Δ log L

    of the equations, or of the angle where that decided.

    Args:
        found: the search of one joint.

    Returns:
        By the sorted names of the effects, () for none of them; natural logarithms,
        0 for the chosen set [1].

    Source:
        `Search.behind`, on stretches that no fit saw.
    """
    models: list[Model] = [found.base, *found.rejected, *found.without.values()]
    for others in found.alternatives.values():
        models += others
    said: dict[tuple[str, ...], float] = {}
    for m in models:  # a set that was fitted twice counts by its better fit
        key = tuple(sorted(m.effects))
        value = -found.behind(m)
        said[key] = max(said.get(key, value), value)
    return {**said, tuple(sorted(found.best.effects)): 0.0}
