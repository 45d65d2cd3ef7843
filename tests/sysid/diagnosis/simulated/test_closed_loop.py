"""The judge's simulation against a servo that is integrated here, and the judge."""

from dataclasses import replace
from types import SimpleNamespace

import jax.numpy as jnp
import numpy as np
import pytest
from support.plain_servo import COULOMB, problem_with

from sysid.diagnosis.measured.resampling import SMOOTH_STEPS
from sysid.diagnosis.replay.surroundings import turned
from sysid.diagnosis.search.judge import Judge
from sysid.diagnosis.simulated.closed_loop import simulated


def error(problem, changes=()):
    """Deviation of the simulated angle with some parameters changed [rad]."""
    theta, changes = problem.space.nominal.copy(), dict(changes)
    for i, slot in enumerate(problem.space.slots):
        if slot.label in changes:
            theta[i] = slot.coordinate(changes[slot.label])
    angle = simulated(problem, theta[None])[0]
    away = np.asarray(problem.data.track.pos) - angle
    return float(np.sqrt(np.mean(away[30:-30] ** 2)))


def test_targets_alone_lead_to_the_measured_angles():
    assert error(problem_with()) < 1.5e-4  # 0.08 ms at 2 rad/s
    late = problem_with(0.01)
    assert error(late) > 5e-3  # half a row without a name
    assert error(late, {"transport_delay.delay_s": 0.01}) < 1.5e-4
    assert error(late, {"transport_delay.delay_s": 0.02}) > 5e-3


def test_the_logged_effort_drives_where_the_law_is_unknown():
    """A servo that nobody knows: its gains do not enter, friction does."""
    problem = problem_with(known="mechanics", row_s=0.002)
    right = error(problem)
    assert error(problem, {"stiffness.scale": 2.0}) == pytest.approx(right, rel=1e-4)
    assert error(problem, {"coulomb_friction.torque_nm": 3.0 * COULOMB}) > 1.5 * right
    assert error(problem, {"load_friction.drive_share": 0.98}) > 2.0 * right


@pytest.mark.parametrize(
    ("label", "value", "read"),
    [
        ("encoder_offset.offset_rad", 0.3, lambda q: q + 0.3),
        ("encoder_scale.scale", 1.25, lambda q: 1.25 * q),
    ],
)
def test_a_window_begins_where_the_encoder_reads_what_it_read(label, value, read):
    """Begun at the reading, the joint would read another angle for a whole window."""
    driven = {"known": "mechanics", "row_s": 0.002}
    right = error(problem_with(**driven))
    assert error(problem_with(**driven, read=read), {label: value}) < 1.3 * right


def test_behind_lost_targets_the_simulation_begins_anew():
    problem = problem_with(row_s=0.004, lost_s=(3.01, 3.13))
    track, dt = problem.data.track, problem.data.dt
    (anew,) = np.flatnonzero(np.asarray(track.resumed)[:, 0])
    assert 3.13 <= anew * dt < 3.15
    theta = problem.space.nominal.copy()
    (gain,) = problem.space.of("stiffness")
    theta[gain] = problem.space.slots[gain].coordinate(0.2)

    def share(problem):
        """Of the error before that is left two steps behind, of a wrong servo."""
        angle = simulated(problem, theta[None])[0]
        away = np.abs(np.asarray(problem.data.track.pos) - angle)[:, 0]
        return away[anew + 2] / away[anew - 4]

    on = replace(track, resumed=0.0 * track.resumed)
    assert share(problem) < 0.5
    assert share(replace(problem, data=replace(problem.data, track=on))) > 0.8
    assert not np.any(problem_with().data.track.resumed)


def test_a_push_from_outside_acts_when_it_does():
    """That of another joint is known from its rows alone: smoothed, and between them
    on straight lines."""
    speed = 2.0 * np.pi * 6.0  # five rows in a third of a period
    problem = problem_with(push=lambda t_s: 0.5 * np.sin(speed * t_s))
    track, dt = problem.data.track, problem.data.dt
    t_s = dt * np.arange(len(track.pos))[:, None] + problem.data.start_s
    kept = np.exp(-0.5 * (SMOOTH_STEPS * speed * dt) ** 2)

    def pushed(late_s):
        seen = 0.5 * kept * np.sin(speed * (t_s - late_s))
        moved = replace(track, push=track.push + seen.astype(np.float32))
        return error(replace(problem, data=replace(problem.data, track=moved)))

    assert pushed(0.0) < 1.5e-4
    assert pushed(0.5 * dt) > 3e-3 and pushed(-0.5 * dt) > 3e-3
    assert error(problem) > 9e-3


def test_late_readings_show_targets_and_pushes_alike_later():
    """Nothing but the clock changes: what another joint pushes is read in time."""
    problem, steps = problem_with(row_s=0.004), 4
    track, dt = problem.data.track, problem.data.dt
    t_s = np.arange(len(track.pos)) * dt
    push = jnp.asarray(0.3 * np.sin(5.0 * t_s)[:, None], jnp.float32)
    data = replace(problem.data, track=replace(track, push=push))
    problem = replace(problem, data=data)
    theta = np.stack([problem.space.nominal] * 2)
    (latency,) = problem.space.of("sensor_latency")
    theta[1, latency] = problem.space.slots[latency].coordinate(steps * dt)
    on_time, late = simulated(problem, theta)[..., 0]
    away = late[100 + steps :] - on_time[100:-steps]
    assert np.abs(away[:-30]).max() < 2e-5  # a push on time would be 1e-3 off


def model_with(error, gained=0.0):
    """A model of which an error of the angle is known, and what it gains."""
    score = 2000.0 - 2.0 * gained
    fit = SimpleNamespace(cost=score)
    return SimpleNamespace(
        effects=(),
        error=error,
        score=score,
        fit=fit,
        noise_cost=0.0,
        variance=lambda samples: 1.0,
        errors=np.ones(2),
    )


def judged(problem, before, after, gained=100.0):
    """What the judge says of two models with given errors of the angle."""
    judge = Judge(problem, None)
    shape = problem.data.valid.shape
    models = [model_with(before), model_with(after, gained)]
    judge.bounded[id(models[0])] = (models[0], models[0])
    judge.fits.update({id(model): (model, model) for model in models})
    judge.output = replace(problem)  # not fitted here
    for model in models:
        rng = np.random.default_rng(3)
        judge.errors[id(model)] = (model, model.error * rng.normal(size=shape))
    return judge.confirms(*models)


@pytest.fixture(scope="module")
def problem():
    return problem_with()


def test_only_what_comes_nearer_is_confirmed(problem):
    assert judged(problem, 0.02, 0.01)
    assert judged(problem, 0.02, 0.016)  # more than a third of its square
    assert not judged(problem, 0.02, 0.018)  # a fifth of it
    assert judged(problem, 0.02, 0.014)
    assert not judged(problem, 0.02, 0.01, gained=2.0)  # as much as chance gains
    assert not judged(problem, 0.01, 0.01)
    assert not judged(problem, 0.01, 0.02)
    assert not judged(problem, 0.01, np.inf)  # a simulation that blows up


def test_where_nothing_can_be_simulated_equations_decide(problem):
    """Unknown forces push the joint: no simulation of it says anything."""
    assert judged(replace(problem, known="controller"), 0.01, 0.02)


def test_a_heavier_load_behind_stronger_drives_moves_as_before():
    problem, more = problem_with(), 1.5
    slots, theta = problem.space.slots, problem.space.nominal.copy()
    place = {slot.label: i for i, slot in enumerate(slots)}

    def put(name, value):
        theta[place[name]] = slots[place[name]].coordinate(value)

    # Far from the measured angle: the weight must be that of the simulated one.
    put("stiffness.scale", 0.3)
    light = theta.copy()
    put("payload_mass.mass_kg", (more - 1.0) * 0.5)
    put("armature.inertia_kgm2", (more - 1.0) * 0.002)
    put("stiffness.scale", more * 0.3)
    put("damping.scale", more)
    put("coulomb_friction.torque_nm", more * COULOMB)
    one, other = simulated(problem, np.stack([light, theta]))
    measured = np.asarray(problem.data.track.pos)
    assert np.abs(one - measured).max() > 0.2
    np.testing.assert_allclose(one, other, atol=2e-4)


def test_the_weight_on_a_slide_does_not_turn():
    """It hangs on a hinge as an arm does, and on a slide as a load."""
    moment, away = jnp.array([0.3, 0.0, 0.0]), jnp.array([np.pi / 2.0])
    hinge, slide = jnp.array([0.0, 0.0, 1.0]), jnp.zeros(3)
    np.testing.assert_allclose(turned(hinge, away, moment), [0.0, 0.3, 0.0], atol=1e-6)
    np.testing.assert_allclose(turned(slide, away, moment), moment)
