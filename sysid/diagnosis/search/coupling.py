"""Which other joint could pull on this one? Tendons couple upward and downward."""

import dataclasses

import jax.numpy as jnp

from sysid.diagnosis.fits.candidate import Model, fit_models
from sysid.diagnosis.fits.problem import Problem
from sysid.diagnosis.replay.motion import JointTrack

EFFECT = "joint_coupling"


def coupled(problem: Problem, base: Model) -> Problem:
    """Takes the neighbour whose coupling gives the smallest error into the track.

    Args:
        problem: with its final noise.
        base: the nominal model with its nuisance parameters fitted.
    """
    names = list(problem.data.neighbours)
    if len(names) < 2 or EFFECT not in problem.space.effects:
        return problem
    others = [
        dataclasses.replace(problem, data=with_neighbour(problem.data, n))
        for n in names
    ]
    start = base.fit.theta
    costs = [fit_models(p, [(EFFECT,)], [start])[0].fit.cost for p in others]
    return others[costs.index(min(costs))]


def with_neighbour(track: JointTrack, name: str) -> JointTrack:
    """Returns the track with another joint as the one that pulls."""
    q, nm = track.neighbours[name]
    fields = {"other_q": jnp.asarray(q, jnp.float32)}
    fields["other_nm"] = jnp.asarray(nm, jnp.float32)
    moved = dataclasses.replace(track.track, **fields)
    return dataclasses.replace(track, track=moved, other=name)
