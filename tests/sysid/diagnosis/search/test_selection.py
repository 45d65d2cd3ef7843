"""What an effect must gain, and when a search runs again, with models written here."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from support.plain_servo import problem_with

from sysid.diagnosis.fits.candidate import CONVERGED, fit_models
from sysid.diagnosis.fits.parameters import Slot, Space
from sysid.diagnosis.search import search as searching
from sysid.diagnosis.search import selection
from sysid.diagnosis.search import stage as staging
from sysid.diagnosis.search.search import STRAINED, search
from sysid.diagnosis.search.selection import accepted
from sysid.diagnosis.search.stage import still_accepted

SHARE = Slot("load_friction", "drive_share", "1", "linear", 1.0, 0.0, 0.0, 0.8, 0.0,
             (), True)  # fmt: skip
LEAVES = 100.0


def friction_accepted(monkeypatch, share, leaves, repeat):
    """Whether a share of the torque is taken that leaves so much of `LEAVES`."""
    monkeypatch.setattr(selection, "log_likelihood_gain", lambda *_: 1e4)
    problem = SimpleNamespace(
        space=Space((SHARE,)),
        samples=200,
        repeat=repeat,
        data=SimpleNamespace(effort=np.array([True])),
        channel_counts=lambda: np.array([100, 100]),
    )
    nothing = SimpleNamespace(effects=(), errors=np.array([1.0, LEAVES]), penalty=0.0)
    friction = SimpleNamespace(
        effects=("load_friction",),
        errors=np.array([1.0, leaves]),
        penalty=0.0,
        fit=SimpleNamespace(theta=np.array([share])),
    )
    return accepted(problem, nothing, friction, nothing)


@pytest.mark.parametrize("share", [0.3, 0.8])
def test_friction_that_only_scales_what_is_left_is_no_cause(monkeypatch, share):
    """A share K of the torque leaves (1 − K)² of any error, whatever it lacks."""
    trivial = LEAVES * (1.0 - share) ** 2
    assert not friction_accepted(monkeypatch, share, 1.01 * trivial, repeat=False)
    assert friction_accepted(monkeypatch, share, 0.99 * trivial, repeat=False)


def test_repeats_say_what_is_noise_and_friction_need_not(monkeypatch):
    assert friction_accepted(monkeypatch, 0.8, LEAVES * 0.05, repeat=True)


@pytest.mark.parametrize(
    ("effect", "names", "limit", "taken"),
    [
        ("acceleration_limit", ("acceleration_rad_s2",), 30_000.0, False),
        ("acceleration_limit", ("acceleration_rad_s2",), 3_000.0, True),
        ("directional_slew", ("up_rad_s", "down_rad_s"), 5_000.0, False),
        ("directional_slew", ("up_rad_s", "down_rad_s"), 300.0, True),
    ],
)
def test_a_time_within_a_servos_cycle_is_no_cause(
    monkeypatch, effect, names, limit, taken
):
    """At 3 rad/s limits of an acceleration last 0.1 and 1 ms, speeds 0.2 and 3 ms."""
    monkeypatch.setattr(selection, "log_likelihood_gain", lambda *_: 1e4)
    slots = [
        Slot(effect, name, "", "reciprocal", 30.0, 0.0, 0.0, 2.0, 0.0, (), True)
        for name in names
    ]
    problem = SimpleNamespace(
        space=Space(tuple(slots)),
        samples=200,
        data=SimpleNamespace(speed_scale=3.0, angle_scale=1.0, torque_scale=1.0),
        channel_counts=lambda: np.array([100, 100]),
    )
    found = SimpleNamespace(theta=np.full(len(slots), 30.0 / limit))
    models = [
        SimpleNamespace(effects=e, errors=np.array([1.0, x]), penalty=0.0, fit=fit)
        for e, x, fit in (((), 100.0, None), ((effect,), 1.0, found))
    ]
    assert accepted(problem, *models, models[0]) == taken


def searches_alone(monkeypatch, base, searched, lost=False):
    """Leaves of a search the order of its runs: what each finds is said here."""
    monkeypatch.setattr(searching, "settled", lambda p: (p, base))
    monkeypatch.setattr(searching, "coupled", lambda p, b: p)
    monkeypatch.setattr(searching, "in_parts", lambda p, b: (p, b))
    monkeypatch.setattr(searching, "output_problem", lambda p: None)
    monkeypatch.setattr(searching, "fit_models", lambda *_: [base])
    monkeypatch.setattr(searching, "_searched", searched)
    monkeypatch.setattr(searching, "_by_angle", lambda found: found)
    monkeypatch.setattr(searching, "_with_first", lambda again, first: again)
    monkeypatch.setattr(searching, "_loses_angle", lambda again, first: lost)


@pytest.mark.parametrize(
    ("penalty", "effects", "repeat", "runs"),
    [
        (0.9 * STRAINED, (), False, 1),
        (1.1 * STRAINED, (), False, 2),
        (0.0, ("backlash",), False, 2),
        (1.1 * STRAINED, ("backlash",), True, 1),
    ],
)
def test_a_search_runs_again_where_tolerances_are_strained(
    monkeypatch, penalty, effects, repeat, runs
):
    """Without repeats, with what the first run left as noise."""
    fit = SimpleNamespace(theta=np.zeros(1))
    base = SimpleNamespace(penalty=penalty, fit=fit)
    best = SimpleNamespace(effects=effects, fit=fit)
    problem = SimpleNamespace(repeat=repeat, raw=lambda theta: [np.full(2, 3.0)])
    problem.with_remaining = lambda left: SimpleNamespace(left=left)
    found = SimpleNamespace(best=best, base=base, problem=problem)
    seen = []

    def searched(problem, base):
        seen.append(problem)
        return found

    searches_alone(monkeypatch, base, searched)
    assert search(problem) is found
    assert len(seen) == runs
    assert runs == 1 or seen[1].left.tolist() == [3.0, 3.0]
    left = SimpleNamespace(raw=lambda theta: [np.full(2, 5.0)])
    left.with_remaining = problem.with_remaining
    found.problem = left  # the angle was searched, and is searched again
    search(problem)
    assert runs == 1 or seen[-1].left.tolist() == [5.0, 5.0]


@pytest.mark.parametrize("lost", [True, False])
def test_a_second_search_that_loses_the_angle_is_not_the_answer(monkeypatch, lost):
    fit = SimpleNamespace(theta=np.zeros(1))
    base = SimpleNamespace(penalty=0.0, fit=fit)
    best = SimpleNamespace(effects=("backlash",), fit=fit)
    problem = SimpleNamespace(repeat=False, raw=lambda theta: [np.full(2, 3.0)])
    problem.with_remaining = lambda left: problem
    results = [SimpleNamespace(best=best, base=base, problem=problem) for _ in range(2)]
    left = iter(results)
    searches_alone(monkeypatch, base, lambda *_: next(left), lost)
    assert search(problem) is results[0 if lost else 1]


@pytest.mark.parametrize(
    ("first", "second", "gains", "kept"),
    [
        (("backlash",), (), True, True),
        (("backlash",), (), False, False),
        (("backlash",), ("backlash", "stiffness"), True, False),
        (("backlash",), ("hysteresis",), True, True),
    ],
)
def test_a_second_search_does_not_lose_the_answer_of_the_first(
    monkeypatch, first, second, gains, kept
):
    """By the noise that the first left its starts may end in another valley."""
    answer = SimpleNamespace(effects=first, fit=SimpleNamespace(theta=np.ones(1)))
    again = SimpleNamespace(
        problem="problem", base="base", best=SimpleNamespace(effects=second)
    )
    monkeypatch.setattr(searching, "fit_models", lambda *_, **__: [answer])
    monkeypatch.setattr(searching, "accepted", lambda *_: gains)
    monkeypatch.setattr(searching, "_searched", lambda *begun: begun)
    found = searching._with_first(again, answer)
    assert found == (("problem", "base", answer) if kept else again)


@pytest.mark.parametrize(
    ("first", "second", "kept"),
    [
        (0.8, 45.0, True),
        (0.8, 1.2, False),
        (44.0, 45.0, False),
        (None, 45.0, False),
    ],
)
def test_what_the_angle_was_explained_by_is_not_lost_to_the_noise_of_the_equations(
    monkeypatch, first, second, kept
):
    """Of an angle's error of 45 a first answer leaves so much, and a second one."""

    def left(error, effects=()):
        return SimpleNamespace(effects=effects, errors=np.array([0.0, error]))

    monkeypatch.setattr(searching, "nearest", lambda _, model: model)
    output = object.__new__(searching.OutputProblem)
    best = left(45.0) if first is None else left(first, ("stribeck_friction",))
    base, judge = left(45.0), SimpleNamespace(output=output)
    found = SimpleNamespace(judge=judge, problem="equations", base=base, best=best)
    again = SimpleNamespace(best=left(second, ("deadband",)))
    assert searching._loses_angle(again, found) == kept
    found.problem = output  # the angle decided, and there is one search of it
    assert not searching._loses_angle(again, found)


def test_a_model_that_was_left_behind_is_fitted_from_where_the_smaller_one_is():
    problem = problem_with(late_s=0.03)
    nothing, delay, nominal = (), ("transport_delay",), problem.space.nominal
    (smaller,) = fit_models(problem, [nothing], [nominal], rounds=CONVERGED)
    behind = nominal.copy()
    behind[problem.space.of("stiffness")] += 1.0
    (stuck,) = fit_models(problem, [delay], [behind], rounds=0)
    assert not accepted(problem, smaller, stuck, smaller)
    (again,) = still_accepted(problem, smaller, [stuck], smaller)
    assert again.effects == delay and accepted(problem, smaller, again, smaller)
    assert still_accepted(problem, smaller, [again], smaller) == [again]
    assert still_accepted(problem, again, [again], smaller) == []


def test_what_is_fitted_again_leaves_the_simplest_first(monkeypatch):
    """A limit of each direction is by chance ahead of one of both."""
    problem = problem_with()
    (smaller,) = fit_models(problem, [()], [problem.space.nominal])
    one, each, stuck = (
        replace(smaller, effects=(effect,), score=score)
        for effect, score in (
            ("slew_limit", 10.5),
            ("directional_slew", 10.0),
            ("backlash", 20.0),
        )
    )
    monkeypatch.setattr(staging, "accepted", lambda _, __, m, ___: m is not stuck)
    monkeypatch.setattr(staging, "fit_models", lambda *_, **__: [])
    kept = still_accepted(problem, smaller, [one, each, stuck], smaller)
    assert kept == [one, each]
