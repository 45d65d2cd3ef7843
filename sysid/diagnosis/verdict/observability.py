"""Effects that the records do not excite: at sizes that matter they leave no trace."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from envs.actuator.catalogue import CATALOGUE
from sysid.diagnosis.fits.parameters import Slot
from sysid.diagnosis.search.search import Examined, Search

SEEN = 12.0
"""Log-likelihood gain from which on an effect counts as seen."""


def common_blind_effects(searched: Sequence[Examined]) -> tuple[str, ...]:
    """Returns effects that no joint's records could show."""
    sets = [set(blind_effects(e.found)) for e in searched]
    common = set.intersection(*sets)
    return tuple(name for name in CATALOGUE if name in common)


def blind_effects(found: Search) -> list[str]:
    """Returns effects whose smallest size that matters leaves no trace here."""
    problem, model = found.problem, found.best
    space = problem.space
    names = [e for e in space.effects if e not in model.effects]
    thetas, owners = [], []
    for name in names:
        for index in space.of(name):
            slot = space.slots[index]
            if slot.effect and (not slot.vanishes or slot.name not in _shapes(name)):
                theta = model.fit.theta.copy()
                theta[index] = _matters(slot)
                thetas.append(theta)
                owners.append(name)
    rs = problem.residual(np.stack(thetas)) - model.fit.residual
    scale = model.variance(found.samples)
    best = {name: 0.0 for name in names}
    for name, r in zip(owners, rs, strict=True):
        best[name] = max(best[name], _unabsorbed(found, r, space.of(name)) / scale)
    return [name for name in names if best[name] < 2.0 * SEEN]


def _unabsorbed(found: Search, r: Float[np.ndarray, " r"], own: list[int]) -> float:
    """Returns the squared change that no other parameter compensates.

    Args:
        found: a search.
        r: change of the residual.
        own: coordinates of what changed.
    """
    fit, effects = found.best.fit, found.best.effects
    others = ~np.isin(fit.free, own)
    prior_sd = found.problem.space.prior_sds(effects)[fit.free[others]]
    j = np.concatenate([fit.jacobian[:, others], np.diag(1.0 / prior_sd)])
    q, _ = np.linalg.qr(j)
    taken = q.T @ np.concatenate([r, np.zeros(len(prior_sd))])
    return float(r @ r - taken @ taken)


def _shapes(effect: str) -> set[str]:
    """Parameters that only shape an effect."""
    return {n for n, p in CATALOGUE[effect].parameters.items() if p.identity is None}


def _matters(slot: Slot) -> float:
    """Coordinate of the smallest size that would matter."""
    if slot.effect == "torque_limit":
        # Loads ask for more torque than these records did: a limit matters above it.
        return 0.9 * slot.nominal
    if slot.kind == "reciprocal":
        return 1.1 * slot.nominal if slot.nominal > 0.0 else 1.1
    if slot.kind == "log":
        return slot.nominal + 0.1
    if slot.many_optima:
        return 0.1
    if slot.unit == "s":  # 2 ms; fits begin from many delays
        return slot.nominal + 0.1
    if slot.starts:
        grid = [u for u in slot.starts if u > 0.0]
        return slot.nominal + sorted(grid)[len(grid) // 2]
    return slot.nominal + 0.1
