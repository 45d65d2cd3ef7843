"""Neighbours that pull, repeats under jitter, and what remains unexplained."""

from dataclasses import replace
from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from benchmarks.diagnosis.hidden.believed import believed
from benchmarks.diagnosis.hidden.cases import draw_case
from benchmarks.diagnosis.hidden.recording import standard
from benchmarks.diagnosis.hidden.sampling import Noise, record
from benchmarks.diagnosis.hidden.stands import make_stand
from sysid.diagnosis.diagnose import problem_of
from sysid.diagnosis.fits.candidate import fit_models
from sysid.diagnosis.fits.starts import starts_of
from sysid.diagnosis.measured.segments import grid_step_s
from sysid.diagnosis.replay.track import all_tracks
from sysid.diagnosis.search import exchange
from sysid.diagnosis.search.by_angle import nearest
from sysid.diagnosis.search.coupling import coupled, with_neighbour
from sysid.diagnosis.search.judge import Judge
from sysid.diagnosis.search.search import Search
from sysid.diagnosis.search.settling import settled
from sysid.diagnosis.verdict.unexplained import (
    _depending,
    _jumps,
    _Left,
    _left,
    _remaining,
    unexplained_signs,
)
from sysid.diagnosis.verdict.verdict import _largest
from sysid.diagnosis.verdict.wording import summary_of
from sysid.logs.log import make_log
from sysid.result import Cause, Gain


@pytest.fixture(scope="module")
def searched():
    """A joint without any effect, and its problem."""
    case = draw_case(17, kind="pendulum", round_s=6.0)
    mechanism, logs = believed(case.stand), list(case.logs)
    problem = problem_of(all_tracks(logs, mechanism)[0], logs, mechanism, False)
    problem, base = settled(problem)
    samples = int(problem.counts().sum())
    return Search(problem, base, base, {}, {}, [], samples, Judge(problem, base))


@pytest.mark.parametrize("other", [0, 2])
def test_a_joint_is_pulled_from_below_or_above(other):
    rng = np.random.default_rng(3)
    stand = make_stand("finger", rng)
    once = standard(rng, stand.middle, stand.reach, 200.0, 6.0, 1)
    truth = stand.mechanism.with_effect(
        1, "joint_coupling", other=other, stiffness_nm_rad=0.05
    )
    log = record(truth, once, Noise(), rng, palm_quat_w=stand.mechanism.base_quat_w)
    mechanism, names = believed(stand), stand.names
    track = all_tracks([log], mechanism)[1]
    assert list(track.neighbours) == [names[0], names[2]]
    problem, base = settled(problem_of(track, [log], mechanism, True))
    found = coupled(problem, base).data
    assert found.other == names[other]
    assert np.asarray(found.track.other_q)[:, 0] == pytest.approx(
        np.asarray(with_neighbour(track, names[other]).track.other_q)[:, 0]
    )


def test_jitter_does_not_widen_the_grid():
    """The median of these steps is 5.01 ms, and repeats would be missed."""
    steps = np.resize([0.00501, 0.00501, 0.00501, 0.00497], 4000)
    t_s = np.concatenate([[0.0], np.cumsum(steps)])
    t_s = np.delete(t_s, [500, 1500])
    columns = {"cmd.a": np.sin(t_s), "pos.a": np.sin(t_s)}
    step_s = grid_step_s([make_log(("a",), t_s, columns)], ["a"])
    assert step_s == pytest.approx(0.005, rel=2e-5)


def test_nothing_is_unexplained_of_a_joint_without_effects(searched):
    assert unexplained_signs(searched) == []


def test_much_more_than_noise_that_remains_is_unexplained(searched):
    wrong = replace(searched.best, errors=np.array([1.0, 4.6]))
    before = replace(searched.best, errors=np.array([1.0, 16.0]))
    signs = _remaining(_Left(searched.problem, before, wrong, sure=True))
    assert len(signs) == 1
    assert "mechanics residual" in signs[0]
    assert _remaining(_Left(searched.problem, before, wrong, sure=False)) == []
    right = replace(searched.best, errors=np.array([1.0, 1.9]))
    assert _remaining(_Left(searched.problem, before, right, sure=True)) == []


@pytest.mark.parametrize("repeats", [True, False])
def test_a_motion_that_the_simulation_does_not_follow_is_unexplained(repeats):
    """Ripple of gears is in no catalogue; without it the test above is the control."""
    case = draw_case(17, ("gear_ripple",), kind="pendulum", round_s=6.0)
    mechanism, logs = believed(case.stand), list(case.logs)
    problem = problem_of(all_tracks(logs, mechanism)[0], logs, mechanism, False)
    problem, base = settled(problem if repeats else replace(problem, repeat=None))
    parts = (problem.samples, Judge(problem, base))
    found = Search(problem, base, base, {}, {}, [], *parts)
    signs = unexplained_signs(found)
    assert any("the position residual is" in x for x in signs)
    assert any("the position residual depends on the position" in x for x in signs)


@pytest.mark.parametrize("repeats", [True, False])
def test_a_motion_without_effects_is_followed(searched, repeats):
    problem = searched.problem
    problem, base = settled(problem if repeats else replace(problem, repeat=None))
    parts = (problem.samples, Judge(problem, base))
    left = _left(Search(problem, base, base, {}, {}, [], *parts))
    assert left.problem.channels[1] == "position"
    assert left.best.errors[1] < 1.3
    assert _depending(left) == []


def test_sizes_at_the_end_of_their_range_explain_nothing(searched):
    problem = searched.problem
    (i,) = problem.space.of("encoder_scale")
    model = fit_models(problem, [("encoder_scale",)], [searched.base.fit.theta])[0]
    met = "encoder_scale.scale met its bound"
    assert met not in str(unexplained_signs(replace(searched, best=model)))
    theta = model.fit.theta.copy()
    theta[i] = problem.space.slots[i].high
    edge = replace(model, fit=replace(model.fit, theta=theta, bounded=(i,)))
    assert met in str(unexplained_signs(replace(searched, best=edge)))


def test_a_cause_that_moves_a_parameter_off_its_prior_is_not_all(searched):
    problem = searched.problem
    (i,) = problem.space.of("stiffness")
    model = fit_models(problem, [("hysteresis",)], [searched.base.fit.theta])[0]
    theta = model.fit.theta.copy()
    theta[i] = problem.space.slots[i].nominal + 6.0 * problem.space.slots[i].prior_sd
    off = replace(model, fit=replace(model.fit, theta=theta))
    signs = unexplained_signs(replace(searched, best=off))
    assert any("stiffness.scale lies 6" in text for text in signs)


def test_jumps_that_do_not_repeat_are_not_noise(searched):
    problem = searched.problem
    track, noise = problem.data.track, problem.data.noise[0]
    pos = np.array(track.pos)
    rows = np.flatnonzero(problem.valid[0][:, 0])[[200, 700]] * 4 + 8
    for row in rows:
        pos[row - 8 : row + 9] += 20.0 * noise
    data = replace(problem.data, track=track.replace(pos=pos))
    jumpy = replace(problem, data=data)
    judge = Judge(jumpy, searched.base)
    found = replace(searched, problem=jumpy, judge=judge)
    signs = unexplained_signs(found)
    assert any("position residual has jumps" in text for text in signs)
    model = fit_models(problem, [("hysteresis",)], [searched.base.fit.theta])[0]
    signs = unexplained_signs(replace(found, best=model))
    assert not any("position residual has jumps" in text for text in signs)


@pytest.mark.parametrize("times", [3.0, 30.0])
def test_jumps_of_the_effort_alone_are_not_noise(searched, times):
    """Packets that change places: a joint's inertia leaves nothing in the angle."""
    problem = searched.problem
    track, noise = problem.data.track, problem.data.noise[1]
    effort = np.array(track.effort)
    rows = np.flatnonzero(problem.valid[0][:, 0])[[200, 700]] * 4 + 8
    for row in rows:
        effort[row - 1 : row + 2] += times * noise
    data = replace(problem.data, track=track.replace(effort=effort))
    jumpy = replace(problem, data=data)
    found = replace(searched, problem=jumpy, judge=Judge(jumpy, searched.base))
    signs = [text for text in unexplained_signs(found) if "jumps" in text]
    assert all("controller" in text for text in signs)
    assert bool(signs) == (times > 10.0)


def test_a_parameter_that_is_far_off_its_prior_goes_on_from_there(searched):
    problem, base = searched.problem, searched.base
    (i,) = problem.space.of("damping")
    theta = base.fit.theta.copy()
    theta[i] = problem.space.slots[i].nominal + 6.0 * problem.space.slots[i].prior_sd
    gone = replace(base, fit=replace(base.fit, theta=theta))
    far = starts_of(problem, gone, ["damping"])["damping"]
    assert any(start is theta for start in far)
    near = starts_of(problem, base, ["damping"])["damping"]
    assert not any(start is base.fit.theta for start in near)


def test_steps_of_an_encoder_are_no_jumps(searched):
    """Where next to nothing remains unexplained, a least step is an outlier."""
    problem = searched.problem
    quiet = np.zeros((2, *problem.valid.shape[1:]))
    at = np.argwhere(problem.valid[0])[100]
    quiet[0][tuple(at)] = problem.noise[0].deviation
    assert not _jumps(problem, quiet[0], 0)
    quiet[0][tuple(at)] *= 20.0
    assert _jumps(problem, quiet[0], 0)


@pytest.mark.parametrize(("times", "jumps"), [(1.0, False), (10.0, True)])
def test_what_a_cycle_makes_of_an_angle_at_speed_is_no_jump(searched, times, jumps):
    """Cycles that mostly fall alike leave fast samples, which weigh little, quiet."""
    problem, share = searched.problem, 0.05
    size, weight = problem.noise[0].deviation, np.full_like(problem.weight, share)
    noise = tuple(replace(n, deviation=share * n.deviation) for n in problem.noise)
    problem = replace(problem, weight=weight, noise=noise)
    error = size * np.random.default_rng(2).normal(size=weight.shape[1:])
    twin = problem.differences(error, problem.valid[0])[1]
    # Weighing as little, it is uncertain by 1 / w times the noise.
    error[tuple(np.argwhere(twin)[-50])] += np.sqrt(2.0) * times * size / share
    assert _jumps(problem, weight[0] * error, 0) == jumps


def ahead(base, effects, gained):
    """A model with these effects that gains so much [nat]."""
    score = base.score - 2.0 * gained
    fit = replace(base.fit, cost=base.fit.cost - 2.0 * gained)
    errors = base.errors - gained / 200.0
    return replace(base, effects=effects, score=score, fit=fit, errors=errors)


def offer(monkeypatch, offered, without):
    """Lets these models take the places of causes."""
    monkeypatch.setattr(
        exchange,
        "swapped",
        lambda problem, best, base: (offered.get(best.effects, {}), without),
    )
    monkeypatch.setattr(exchange, "pruned", lambda problem, model, base: model)


def test_a_better_effect_takes_the_place_of_a_cause(searched, monkeypatch):
    """The first of two causes was chosen when it had to stand for both."""
    problem = searched.problem
    base = replace(searched.base, errors=np.array([4.0, 4.0]))
    scored = partial(ahead, base)
    first = scored(("payload_com", "deadband"), 300.0)
    right = scored(("deadband", "joint_coupling"), 340.0)
    alone = scored(("deadband",), 100.0)
    without = {"payload_com": alone, "joint_coupling": alone, "deadband": base}
    offered = {first.effects: {"payload_com": [right], "deadband": []}}
    offer(monkeypatch, offered, without)
    willing = SimpleNamespace(confirms=lambda smaller, larger: True)
    assert exchange.exchanged(problem, first, base, willing)[0] is right
    close = scored(right.effects, 302.0)
    offered[first.effects]["payload_com"] = [close]
    assert exchange.exchanged(problem, first, base, willing)[0] is first
    without["deadband"] = scored(("payload_com",), 298.0)
    last = exchange.exchanged(problem, first, base, willing)[0]
    assert last is without["deadband"]


def test_what_contains_a_cause_takes_its_place_if_more_is_shown(searched, monkeypatch):
    """Beside another cause as well, whichever of them came first."""
    scored = partial(ahead, replace(searched.base, errors=np.array([4.0, 4.0])))
    base = scored((), 0.0)
    dry = scored(("deadband", "coulomb_friction"), 300.0)
    falls = scored(("deadband", "stribeck_friction"), 340.0)
    wrong = scored(("deadband", "payload_com"), 200.0)
    names = ("payload_com", *dry.effects, *falls.effects)
    without = dict.fromkeys(names, scored(("deadband",), 1.0)) | {"deadband": base}
    stages = (wrong, [falls, dry]), (dry, [falls]), (falls, [dry])
    offered = {
        m.effects: {m.effects[1]: others, "deadband": []} for m, others in stages
    }
    offer(monkeypatch, offered, without)
    for shown, takes in ((False, dry), (True, falls)):
        judge = SimpleNamespace(problem="equations", output="angle")
        judge.confirms = lambda smaller, larger: True
        judge.explains = lambda smaller, larger: False
        judge.shows = lambda smaller, larger, shown=shown: shown
        for first in (dry, wrong, takes):
            assert exchange.exchanged(searched.problem, first, base, judge)[0] is takes
    judge.shows = lambda smaller, larger: False
    assert exchange.exchanged(searched.problem, falls, base, judge)[0] is dry


def test_causes_that_bring_the_motion_no_nearer_are_no_explanation(
    searched, monkeypatch
):
    """Whatever the equations say; the verdict cannot be `found`."""
    problem, base = searched.problem, searched.base
    wrong = fit_models(problem, [("hysteresis",)], [base.fit.theta])[0]
    found = replace(searched, best=wrong)
    shape = problem.data.valid.shape
    near, far = (s * np.random.default_rng(1).normal(size=shape) for s in (0.01, 0.02))
    moved = found.judge.moved(wrong)
    for model, error in ((found.judge.nominal(base), near), (moved, far)):
        found.judge.errors[id(model)] = (model, error)
    assert any("comes no nearer" in text for text in unexplained_signs(found))
    found.judge.errors[id(moved)] = (moved, 0.5 * near)
    assert not any("comes no nearer" in text for text in unexplained_signs(found))
    # The report says the error of all samples, also of those that the judge discounts.
    moment = np.flatnonzero(found.judge.valid.all(1))[5]
    output, jump = found.judge.output, 0.5 * near
    weight, jump[moment] = np.ones((2, *shape)), 10.0
    weight[:, moment] = 1e-6
    monkeypatch.setattr(found.judge, "output", replace(output, weight=weight))
    found.judge.errors[id(moved)] = (moved, jump)
    assert found.judge.t_value(found.judge.nominal(base), moved) > 0.0
    assert any("comes no nearer" in text for text in unexplained_signs(found))


def test_a_sentence_says_falls_only_where_something_falls():
    falls = Gain(0.2, 0.1, 0.75, 0.7, 0.8, "rad", None)
    rises = Gain(9.43, 9.64, 0.0, 0.0, 0.0, "N", None)
    assert _largest({"controller": falls, "mechanics": rises}) is falls
    assert _largest({"mechanics": rises, "position": falls}) is None
    cause = Cause("deadband", "servo", {}, 30.0)
    said = summary_of("found", [cause], [], None, (), ())
    assert "falls" not in said
    assert "falls" in summary_of("found", [cause], [], falls, (), ())


def test_a_valley_of_free_gains_is_no_sign():
    """What the effort's gains leave counts if the fit with free ones is further off."""
    far, near = (SimpleNamespace(errors=np.array([0.0, x])) for x in (31.0, 1.0))
    served = SimpleNamespace(moved=lambda model: near)
    judge: Any = SimpleNamespace(moved=lambda model: far, serving=lambda model: served)
    assert nearest(judge, far) is near
    judge = SimpleNamespace(moved=lambda model: near, serving=lambda model: judge)
    assert nearest(judge, far) is near
