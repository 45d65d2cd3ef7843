import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fingers_mjx.evaluation import measures as ms

DT = 0.02
NAIL, PAD = np.radians(80.0), np.radians(20.0)


def alive(steps, upto=None):
    return jnp.arange(steps) < (steps if upto is None else upto)


def stepping(steps=1000, touch=10, period=100):
    """Every tip down for `touch` of each `period` steps, up at the start."""
    down = (np.arange(steps) % period) >= period - touch
    return np.repeat(down[:, None], 5, axis=1).astype(np.float32)


def full(value, steps=1000):
    return jnp.full((steps, 5), value, jnp.float32)


@pytest.mark.parametrize(
    ("velocity", "command", "speed"),
    [
        ((0.1, 0.0), (0.16, 0.0), 0.1),
        ((0.1, 0.0), (0.0, 0.16), 0.0),
        ((0.1, 0.0), (-0.05, 0.0), -0.1),
        ((0.06, 0.08), (0.03, 0.04), 0.1),
        ((0.0, 0.1), (0.1, 0.1), 0.1 / np.sqrt(2)),
        ((0.1, 0.0), (0.02, 0.0), 0.1),
        ((0.1, 0.0), (0.019, 0.0), np.nan),
    ],
)
def test_task_speed_is_the_projection_on_the_command(velocity, command, speed):
    vel = jnp.tile(jnp.array(velocity), (50, 1))
    commands = jnp.tile(jnp.array((*command, 0.4)), (50, 1))
    found = ms.task_speed_mps(vel, commands, alive(50))
    np.testing.assert_allclose(found, speed, atol=1e-7)


def test_task_speed_leaves_out_steps_without_command_and_after_the_end():
    vel = jnp.array([[0.1, 0], [0.3, 0], [9.0, 0], [jnp.nan, 0]])
    command = jnp.array([[0.1, 0, 0], [0.1, 0, 0], [0.0, 0, 0], [0.1, 0, 0]])
    found = ms.task_speed_mps(vel, command, alive(4, 3))
    np.testing.assert_allclose(found, 0.2, rtol=1e-6)
    assert np.isnan(ms.task_speed_mps(vel, command, alive(4)))  # negative control


def test_task_speed_does_not_depend_on_the_heading_of_v():
    print("seed", 11)
    rng = np.random.default_rng(11)
    vel, command = rng.normal(size=(40, 2)), rng.normal(size=(40, 3))
    c, s = np.cos(0.7), np.sin(0.7)
    turn = np.array([[c, -s], [s, c]])
    turned = np.concatenate([command[:, :2] @ turn.T, command[:, 2:]], axis=1)
    plain = ms.task_speed_mps(jnp.array(vel), jnp.array(command), alive(40))
    both = ms.task_speed_mps(jnp.array(vel @ turn.T), jnp.array(turned), alive(40))
    one = ms.task_speed_mps(jnp.array(vel), jnp.array(turned), alive(40))
    np.testing.assert_allclose(both, plain, rtol=1e-5)
    assert abs(one - plain) > 1e-3  # negative control


def test_touchdowns_count_rising_edges_at_the_threshold():
    force = np.zeros((8, 5), np.float32)
    force[:, 0] = [0, 0.15, 0.15, 0, 1, 0, 1, 0]  # the threshold itself is contact
    force[:, 1] = [1, 1, 1, 1, 1, 1, 1, 1]  # standing from the start on
    force[:, 2] = [1, 0, 1, 0, 1, 0, 1, 0]
    force[:, 3] = 0.149
    force[:, 4] = [0, 0, 0, 0, 0, 0, 0, 1]
    whole = ms.touchdowns(jnp.array(force), alive(8))
    np.testing.assert_array_equal(whole, [3, 0, 3, 0, 1])
    ended = ms.touchdowns(jnp.array(force), alive(8, 6))
    np.testing.assert_array_equal(ended, [2, 0, 2, 0, 0])


@pytest.mark.parametrize(
    ("touchdowns", "contact_steps", "takes_part"),
    [(3, 50, 1), (2, 50, 0), (3, 49, 0), (2, 49, 0), (10, 500, 1), (0, 1000, 0)],
)
def test_participation_truth_table(touchdowns, contact_steps, takes_part):
    """One tip has the given pattern in 1000 steps, the other four step well."""
    force = stepping()
    force[:, 3] = pattern(touchdowns, contact_steps)
    found = ms.five_finger_participation(jnp.array(force), alive(1000))
    assert float(found) == takes_part


def pattern(touchdowns, contact_steps):
    if touchdowns == 0:
        return np.ones(1000)
    down = np.zeros(1000)
    for k, size in enumerate(np.diff(np.linspace(0, contact_steps, touchdowns + 1))):
        down[50 + 90 * k : 50 + 90 * k + int(size)] = 1
    missing = contact_steps - int(down.sum())
    last = np.flatnonzero(down)[-1] + 1
    down[last : last + missing] = 1
    assert down.sum() == contact_steps
    return down


def test_participation_counts_the_episodes_own_length():
    force = stepping()  # 10 % of the time, a touchdown every 100 steps
    assert ms.five_finger_participation(jnp.array(force), alive(1000)) == 1
    assert ms.five_finger_participation(jnp.array(force), alive(1000, 310)) == 1
    assert ms.five_finger_participation(jnp.array(force), alive(1000, 190)) == 0
    assert ms.five_finger_participation(jnp.array(force), alive(1000, 0)) == 0


def test_nail_contact_does_not_count_as_taking_part():
    force = jnp.array(stepping())
    tilt = full(PAD)
    args = force, tilt, alive(1000)
    assert ms.non_nail_participation(*args) == 1
    nail = tilt.at[:, 2].set(NAIL)
    assert ms.non_nail_participation(force, nail, alive(1000)) == 0
    assert ms.five_finger_participation(force, alive(1000)) == 1  # negative control
    swing_only = jnp.where(force >= 0.15, tilt, NAIL)
    assert ms.non_nail_participation(force, swing_only, alive(1000)) == 1


@pytest.mark.parametrize(("share", "takes_part"), [(5, 1), (4, 0)])
def test_the_five_percent_are_of_pad_contact(share, takes_part):
    """10 % contact, of which `share` % of the episode below 64°."""
    force = jnp.array(stepping())
    within = np.arange(1000) % 100 - 90
    tilt = np.where((within >= 0) & (within < share), PAD, NAIL)
    found = ms.non_nail_participation(
        force, jnp.array(np.repeat(tilt[:, None], 5, 1), jnp.float32), alive(1000)
    )
    assert float(found) == takes_part


def test_contact_tilt_averages_contact_only():
    force = jnp.array(stepping(10, 5, 10)).at[:, 4].set(0.0)
    tilt = jnp.where(force >= 0.15, 0.3, 1.5).at[:, 1].add(0.2).at[7, 0].add(1.0)
    found = ms.contact_tilt_rad(force, tilt, alive(10))
    np.testing.assert_allclose(found, [0.5, 0.5, 0.3, 0.3, np.nan], rtol=1e-6)


def test_worst_tip_is_the_one_with_most_nail_contact():
    force = full(1.0, 10).at[:, 4].set(0.0)  # the little finger never touches
    tilt = full(PAD, 10).at[:4, 1].set(NAIL).at[:7, 2].set(NAIL).at[:, 4].set(NAIL)
    found = ms.worst_tip_planting_fraction(force, tilt, alive(10))
    np.testing.assert_allclose(found, 0.3, rtol=1e-6)
    up = full(0.0, 10)
    assert np.isnan(ms.worst_tip_planting_fraction(up, tilt, alive(10)))


@pytest.mark.parametrize(("degrees", "fraction"), [(63.9, 1.0), (64.1, 0.0)])
def test_the_nail_begins_at_64_degrees(degrees, fraction):
    tilt = full(np.radians(degrees), 10)
    found = ms.worst_tip_planting_fraction(full(1.0, 10), tilt, alive(10))
    assert float(found) == fraction


def test_undesired_contact_and_energy_are_sums_over_living_steps():
    undesired = jnp.array([1, 0, 0, 1, 1]) > 0
    power = jnp.array([1.0, 2.0, 3.0, 4.0, jnp.nan])
    assert ms.undesired_contact_rate(undesired, alive(5, 4)) == 0.5
    np.testing.assert_allclose(ms.energy_j(power, alive(5, 4), DT), 0.2, rtol=1e-6)


def test_path_speed_of_straight_and_circular_motion():
    time = np.arange(500) * DT
    straight = np.stack([0.06 * time, -0.08 * time, 0.1 + 0 * time], axis=1)
    found = ms.path_speed_mps(jnp.array(straight), alive(500), DT)
    np.testing.assert_allclose(found, 0.1, rtol=1e-4)
    rate, radius = 0.45, 0.2
    circle = radius * np.stack([np.cos(rate * time), np.sin(rate * time), time], 1)
    chord = 2 * radius * np.sin(rate / 2)
    found = ms.path_speed_mps(jnp.array(circle), alive(500), DT)
    np.testing.assert_allclose(found, chord, rtol=1e-4)
    assert 0.99 < chord / (radius * rate) < 1


def test_path_speed_does_not_reward_swaying():
    time = np.arange(500) * DT
    sway = np.stack([0 * time, 0.01 * np.sin(2 * np.pi * 2 * time), 0 * time], axis=1)
    assert ms.path_speed_mps(jnp.array(sway), alive(500), DT) < 1e-5
    raw = np.abs(np.diff(sway[:, 1])).mean() / DT
    assert raw > 0.05  # negative control: the path itself is long


@pytest.mark.parametrize(("upto", "defined"), [(50, False), (51, True)])
def test_path_speed_needs_a_whole_window(upto, defined):
    position = jnp.zeros((500, 3)).at[:, 0].set(jnp.arange(500) * 0.1 * DT)
    found = ms.path_speed_mps(position, alive(500, upto), DT)
    assert bool(np.isfinite(found)) is defined
    short = ms.path_speed_mps(position[:20], alive(20), DT)
    assert np.isnan(short)


def test_cost_of_transport_is_energy_over_weight_and_distance():
    found = ms.cost_of_transport(*map(jnp.array, (8.02, 0.1, 10.0)), mass_kg=0.818)
    np.testing.assert_allclose(found, 8.02 / (0.818 * 9.81 * 1.0), rtol=1e-6)
    rest = ms.cost_of_transport(*map(jnp.array, (8.02, 0.0, 10.0)), mass_kg=0.818)
    assert np.isnan(rest)


def test_survival_and_the_end_of_an_episode():
    done = jnp.array([0, 0, 1, 0, 1]) > 0
    np.testing.assert_array_equal(ms.steps_alive(done, done), [1, 1, 0, 0, 0])
    in_time = ms.steps_alive(done, done & False)
    np.testing.assert_array_equal(in_time, [1, 1, 1, 0, 0])
    assert ms.survival(done) == 0
    assert ms.survival(done & False) == 1


def test_measures_vmap_over_episodes():
    force = jnp.stack([jnp.array(stepping()), jnp.zeros((1000, 5))])
    mask = jnp.stack([alive(1000)] * 2)
    both = jax.jit(jax.vmap(ms.five_finger_participation))(force, mask)
    np.testing.assert_array_equal(both, [1, 0])
