"""Masses and rotor that are each lighter than believed leave some inertia together."""

import numpy as np
from support.plain_servo import problem_with


def test_no_link_of_less_than_nothing_runs_away_behind_a_spring():
    problem = problem_with()
    theta, slots = problem.space.nominal.copy(), problem.space.slots
    names = [slot.name for slot in slots]
    theta[names.index("mass")] = np.log(0.5)
    theta[problem.space.of("armature")] = [-0.8]
    softness, rotor = problem.space.of("compliance")
    behind = []
    for soft in slots[softness].starts:
        behind.append(theta.copy())
        behind[-1][[softness, rotor]] = soft, slots[rotor].starts[0]
    assert np.isfinite(problem.residual(np.stack([theta, *behind]))).all()
