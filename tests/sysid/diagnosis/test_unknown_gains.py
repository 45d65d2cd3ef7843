"""Gains that nobody knows, and an effort that shows them.

In the simulation of the angle alone a servo's free damping does what friction does. The
records are integrated here, by none of the project's simulators.
"""

from dataclasses import replace

import numpy as np
import pytest

from envs.physics.quiet_mujoco import mujoco
from sysid.diagnosis.diagnose import diagnose, problem_of
from sysid.diagnosis.fits.candidate import fit_models
from sysid.diagnosis.fits.intervals import standard_errors
from sysid.diagnosis.fits.origins import begun_anew, near_nominal
from sysid.diagnosis.fits.space import SIGMA
from sysid.diagnosis.replay.track import all_tracks
from sysid.diagnosis.search.judge import Judge
from sysid.diagnosis.search.settling import settled
from sysid.diagnosis.search.shown_gains import GAIN_TOLERANCE
from sysid.drive import JointDrive, Nominal
from sysid.logs.log import make_log
from sysid.mechanism import model_mechanism

RATE_HZ, DT = 250.0, 0.0005
KP, KD, WEIGHT, INERTIA = 3.0, 0.05, 0.075, 0.01325
ARM = """
<mujoco><worldbody><body><joint name="servo" axis="0 1 0" armature="0.002"/>
<inertial pos="0 0 -0.15" mass="0.5" diaginertia="1e-5 1e-5 1e-5"/>
</body></worldbody></mujoco>"""
PERIOD_S, PERIODS = 6.0, 3


def recorded(viscous_nms, free=True, seed=0, tolerance=0.05):
    """A log of a servo at a pendulum with this friction, and what is known of it."""
    rng = np.random.default_rng(seed)
    rows = round(PERIOD_S * RATE_HZ)
    t_s = np.arange(rows) / RATE_HZ
    phases = rng.uniform(0.0, 2.0 * np.pi, 8)
    waves = [np.sin(2 * np.pi * (k + 1) * t_s / PERIOD_S + f) for k, f in
             enumerate(phases)]  # fmt: skip
    once = 0.25 * np.sum(waves, 0)
    cmd = np.tile(once, PERIODS)
    q, v, torque, angle, effort = cmd[0], 0.0, 0.0, [], []
    for target in cmd:
        angle.append(q)
        effort.append(torque)
        for _ in range(round(1.0 / RATE_HZ / DT)):
            torque = KP * (target - q) - KD * v
            rest = torque - WEIGHT * 9.81 * np.sin(q)
            v = (v + DT * rest / INERTIA) / (1.0 + DT * viscous_nms / INERTIA)
            q += DT * v
    shape = (2, len(cmd))
    noise = np.array([[3e-4], [2e-2]]) * rng.normal(size=shape)
    columns = {
        "cmd.servo": cmd,
        "pos.servo": np.array(angle) + noise[0],
        "tau.servo": np.array(effort) + noise[1],
    }
    log = make_log(("servo",), np.arange(len(cmd)) / RATE_HZ, columns)
    gains = [Nominal(x, tolerance, free=free) for x in (0.5 * KP, 3.0 * KD)]
    model = mujoco.MjModel.from_xml_string(ARM)
    return [log], model_mechanism(model, {"servo": JointDrive(*gains)})


def nominal(viscous_nms, free=True, tolerance=0.05):
    """The problem of such a servo, and its model without an effect."""
    logs, mechanism = recorded(viscous_nms, free, tolerance=tolerance)
    (track,) = all_tracks(logs, mechanism)
    return settled(problem_of(track, logs, mechanism, company=False))


def with_wrong_damping(problem, model):
    """The model as if the effort had shown it a damping of e^0.5 times that."""
    theta = np.array(model.fit.theta)
    theta[problem.space.of("damping")] += 0.5
    return replace(model, fit=replace(model.fit, theta=theta))


def test_friction_beside_a_free_damping_is_found():
    said = diagnose(*recorded(0.1))
    causes = [c.effect for c in said.causes]
    assert (said.verdict, causes) == ("found", ["viscous_friction"])
    (found,) = said.causes[0].parameters.values()
    assert found.value == pytest.approx(0.1, rel=0.1)


def test_other_gains_alone_are_no_cause():
    assert diagnose(*recorded(0.0)).causes == ()


@pytest.mark.parametrize("free", [True, False])
def test_the_judge_takes_free_gains_from_the_effort(free):
    """Known ones keep their tolerances."""
    problem, base = nominal(0.1, free)
    start = base.fit.theta
    (model,) = fit_models(problem, [("viscous_friction",)], [start], rounds=20)
    judge = Judge(problem, base)
    served = judge.serving(model)
    assert (served is not judge) == free
    for effect, ratio in (("stiffness", 2.0), ("damping", 1.0 / 3.0)):
        (index,) = problem.space.of(effect)
        slot = served.output.space.slots[index]
        if free:
            assert np.exp(slot.nominal) == pytest.approx(ratio, rel=0.1)
            assert slot.prior_sd == pytest.approx(SIGMA * GAIN_TOLERANCE)
            unsure = standard_errors(problem, model, problem.samples)[index]
            assert unsure < slot.prior_sd
        else:
            assert slot == problem.space.slots[index]


@pytest.mark.parametrize(("tolerance", "damping"), [(1.5, 1.0 / 3.0), (0.5, None)])
def test_the_effort_knows_a_gain_better_than_a_wide_tolerance(tolerance, damping):
    """And does not leave it: a gain of a third is beyond a tolerance of a half."""
    problem, base = nominal(0.1, free=False, tolerance=tolerance)
    start = base.fit.theta
    (model,) = fit_models(problem, [("viscous_friction",)], [start], rounds=20)
    space = Judge(problem, base).serving(model).output.space
    for effect, ratio in (("stiffness", 2.0), ("damping", damping)):
        (index,) = problem.space.of(effect)
        known, slot = problem.space.slots[index], space.slots[index]
        assert slot.prior_sd == pytest.approx(SIGMA * GAIN_TOLERANCE)
        assert abs(slot.nominal) <= tolerance + 1e-9
        if tolerance > 1.0:
            assert np.exp(slot.nominal) == pytest.approx(ratio, rel=0.1)
        else:
            assert abs(slot.nominal) == pytest.approx(tolerance)
        assert known.prior_sd == pytest.approx(SIGMA * tolerance)


def test_a_gain_that_is_the_effect_keeps_its_tolerance():
    problem, base = nominal(0.0, free=False, tolerance=0.5)
    (model,) = fit_models(problem, [("damping",)], [base.fit.theta], rounds=20)
    space = Judge(problem, base).serving(model).output.space
    for effect in ("stiffness", "damping"):
        (index,) = problem.space.of(effect)
        same = space.slots[index] == problem.space.slots[index]
        assert same == (effect == "damping")


def test_each_model_has_the_gains_that_the_effort_shows_to_it():
    """Those of a wrong cause would make the simulation without it wrong."""
    problem, base = nominal(0.0)
    (model,) = fit_models(problem, [("viscous_friction",)], [base.fit.theta], rounds=20)
    other = with_wrong_damping(problem, model)
    judge = Judge(problem, base)
    alone, beside = judge.pair(base, model)[0], judge.pair(base, other)[0]
    assert beside is judge.serving(base).nominal(base)
    assert beside.fit.cost == pytest.approx(alone.fit.cost, rel=1e-3)
    served = judge.serving(other).nominal(base)  # as it was once
    assert served.fit.cost > 2.0 * alone.fit.cost


def test_the_smaller_model_may_have_the_gains_that_the_effort_shows_beside_the_effect():
    """Its own may be wrong, and an effect that does nothing would be given what for."""
    problem, base = nominal(0.0)
    (model,) = fit_models(problem, [("viscous_friction",)], [base.fit.theta], rounds=20)
    other = with_wrong_damping(problem, base)
    judge = Judge(problem, base)
    own, without = judge.serving(other).nominal(other), judge.pair(other, model)[0]
    assert judge.fall(own, without) > 0.3
    assert not judge.prefers(other, model)


def test_gains_are_no_surer_than_the_effort_shows_them():
    problem, base = nominal(0.1)
    (index,) = problem.space.of("damping")
    fit = base.fit
    noisy = replace(base, fit=replace(fit, jacobian=1e-3 * fit.jacobian))
    slot = Judge(problem, base).serving(noisy).output.space.slots[index]
    assert slot.prior_sd > 2.0 * SIGMA * GAIN_TOLERANCE


@pytest.mark.parametrize("free", [True, False])
def test_fits_begin_anew_with_free_gains_as_they_were_found(free):
    """They have no nominal value; known ones have, and masses do."""
    problem, base = nominal(0.1, free)
    values = problem.space.values(near_nominal(problem, base)[None])[0]
    kept = values["stiffness"]["scale"][0]
    assert (kept > 1.4) == free  # it is 2, and friction takes a part of it
    (load,) = problem.space.of("payload_mass")
    assert base.fit.theta[load] != near_nominal(problem, base)[load] == 0.0


@pytest.mark.parametrize("free", [True, False])
def test_a_nominal_fit_that_went_astray_for_a_gain_comes_back(free):
    problem, base = nominal(0.0, free)
    theta = np.array(base.fit.theta)
    (load,) = problem.space.of("payload_mass")
    theta[load] += 1.0
    astray = replace(base.fit, theta=theta, cost=2.0 * base.fit.cost)
    model = replace(base, fit=astray)
    back = begun_anew(problem, model)
    assert (back is not model) == free
    assert not free or back.fit.cost < 1.05 * base.fit.cost
