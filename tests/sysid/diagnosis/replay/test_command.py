"""The command path without a low-pass: what acts when, at delays below a row too."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from support import effects_rig as rig

from sysid.diagnosis.measured.resampling import held_targets
from sysid.diagnosis.replay.command import command_path, held_command

DT = 0.01
ROWS = np.arange(400)


def path_at(delay_rows, targets=ROWS, t_s=DT * ROWS, **effects):
    """Path and mean of targets that are sent at the rows."""
    held, sent = held_targets(t_s, targets.astype(float), DT * ROWS, 4)
    params = {"transport_delay": {"delay_s": jnp.array([delay_rows * DT])}, **effects}
    made = command_path(
        jnp.array(held[..., None]), jnp.array(sent[..., None]), params, DT
    )
    return np.asarray(made.path)[:, 0, 0], np.asarray(made.mean)[:, 0, 0]


@pytest.mark.parametrize("delay_rows", [0.0, 0.4, 1.0, 1.7, 4.5])
def test_a_path_without_low_pass_holds_what_has_arrived(delay_rows):
    """At row k the target k − T is the newest; a target of this moment comes after."""
    path, _ = path_at(delay_rows)
    rows = slice(20, 390)
    newest = np.ceil(ROWS - delay_rows - 1e-4) - 1
    assert path[rows] == pytest.approx(newest[rows])


@pytest.mark.parametrize("delay_rows", [0.0, 0.3, 0.7, 1.2])
def test_a_delay_below_a_row_moves_the_mean(delay_rows):
    """Of a staircase that climbs by one each row, the mean falls by T."""
    _, mean = path_at(delay_rows)
    assert mean[20:390] == pytest.approx(ROWS[20:390] - 1.0 - delay_rows, abs=1e-3)


def test_a_target_between_the_rows_acts_from_then():
    """Sent 0.3 rows before row 200, it holds for that share of the step."""
    t_s = np.array([0.0, DT * 199.7])
    path, mean = path_at(0.0, np.array([0.0, 1.0]), t_s)
    assert (path[199], path[200]) == (0.0, 1.0)
    assert mean[200] == pytest.approx(0.3, abs=1e-3)


@pytest.mark.parametrize("late", [1e-12, -1e-12])
def test_rounding_of_a_clock_decides_nothing(late):
    """A row's target acts behind its reading, on either side of the last digit."""
    assert np.array_equal(path_at(0.0)[0], path_at(0.0, t_s=DT * ROWS + late)[0])


def test_a_limit_that_is_absent_is_none():
    """An infinite speed follows at once, in metres and in micrometres."""
    for size in (1.0, 1e-6, 1e6):
        none = path_at(
            0.4, size * ROWS, slew_limit={"speed_rad_s": jnp.array([jnp.inf])}
        )
        assert none[0][20:] == pytest.approx(path_at(0.4, size * ROWS)[0][20:])
    slow = path_at(0.4, slew_limit={"speed_rad_s": jnp.array([50.0])})[0]
    assert np.diff(slow)[50:] == pytest.approx(0.5, abs=1e-4)


def test_limits_of_both_directions_are_those_of_the_chain():
    """The exact path against steps of 10 µs of the effect in the chain."""
    targets = np.where(ROWS % 100 < 50, 1.0, 0.0) + 0.2 * np.sin(0.05 * ROWS)
    limits = {"up_rad_s": jnp.array([1.5]), "down_rad_s": jnp.array([4.0])}
    path, _ = path_at(0.0, targets, directional_slew=limits)
    fine, command, kept = 1000, targets[0], []
    for target in targets:
        kept.append(command)
        for _ in range(fine):
            step = np.clip(target - command, -4.0 * DT / fine, 1.5 * DT / fine)
            command += step
    assert path[1:] == pytest.approx(np.array(kept)[1:], abs=1e-3)
    both = {"speed_rad_s": jnp.array([2.0])}
    alike = {"up_rad_s": jnp.array([2.0]), "down_rad_s": jnp.array([2.0])}
    one = path_at(0.4, targets, slew_limit=both)[0]
    assert path_at(0.4, targets, directional_slew=alike)[0] == pytest.approx(one)


@pytest.mark.parametrize(("cutoff_hz", "most"), [(np.inf, 2e-4), (8.0, 3e-3)])
def test_an_acceleration_is_that_of_the_chain(cutoff_hz, most):
    """The path from message to message against steps of 50 µs of the chain; behind a
    low-pass it is as near as a servo that looks every millisecond."""
    rng = np.random.default_rng(2)
    targets = np.repeat(rng.uniform(-0.6, 0.6, 8), 50) + 0.1 * np.sin(0.2 * ROWS)
    effects = {
        "lowpass_cutoff": {"cutoff_hz": jnp.array([cutoff_hz])},
        "slew_limit": {"speed_rad_s": jnp.array([3.0])},
        "acceleration_limit": {"acceleration_rad_s2": jnp.array([25.0])},
    }
    path, mean = path_at(0.0, targets, **effects)
    fine = 200
    sent = np.append(targets[0], np.repeat(targets, fine))
    passed = rig.run(effects, sent[:, None], dt=DT / fine)[2].command[:, 0]
    assert path[1:] == pytest.approx(passed[fine::fine][: len(path) - 1], abs=most)
    means = passed[1:].reshape(-1, fine).mean(1)
    assert mean[1:] == pytest.approx(means[: len(mean) - 1], abs=most)
    plain = path_at(0.0, targets, **{k: effects[k] for k in list(effects)[:2]})[0]
    assert np.max(np.abs(path - plain)) > 0.2


def test_company_changes_no_candidate():
    """With one that has an acceleration, those without have the path of before."""
    targets = np.where(ROWS % 100 < 50, 1.0, 0.0)
    slow = {"speed_rad_s": jnp.array([2.0, 2.0])}
    limits = {"acceleration_rad_s2": jnp.array([jnp.inf, 10.0])}
    held, sent = held_targets(DT * ROWS, targets, DT * ROWS, 4)
    rows = jnp.array(held[..., None]), jnp.array(sent[..., None])
    params = {"transport_delay": {"delay_s": jnp.full(2, 0.004)}, "slew_limit": slow}
    both = command_path(*rows, params | {"acceleration_limit": limits}, DT)
    plain = command_path(*rows, params, DT)
    for a, b in zip(jax.tree.leaves(both), jax.tree.leaves(plain), strict=True):
        assert np.asarray(a)[..., 0] == pytest.approx(np.asarray(b)[..., 0], abs=1e-6)
    assert np.max(np.abs(both.path - plain.path)[..., 1]) > 0.05
    none = {"acceleration_rad_s2": jnp.full(2, jnp.inf)}
    absent = command_path(*rows, params | {"acceleration_limit": none}, DT)
    for a, b in zip(jax.tree.leaves(absent), jax.tree.leaves(plain), strict=True):
        assert np.asarray(a) == pytest.approx(np.asarray(b), abs=1e-6)


@pytest.mark.parametrize("beside", [5.0, 0.5])
def test_a_way_has_parts_of_its_own_whatever_low_pass_is_beside_it(beside):
    """A low-pass is followed in parts of a step, and a goal that is held in one."""
    targets = np.where(ROWS % 100 < 50, 1.0, 0.0)
    held, sent = held_targets(DT * ROWS, targets, DT * ROWS, 4)
    rows = jnp.array(held[..., None]), jnp.array(sent[..., None])

    def path(*cutoffs):
        cutoff = {"cutoff_hz": jnp.array(cutoffs)}
        limits = {"acceleration_rad_s2": jnp.full(len(cutoffs), 10.0)}
        effects = {"lowpass_cutoff": cutoff, "acceleration_limit": limits}
        return np.asarray(command_path(*rows, effects, 4.0 * DT).path)

    both = path(jnp.inf, beside)
    assert np.array_equal(both[..., 0], path(jnp.inf, jnp.inf)[..., 0])
    assert np.array_equal(both[..., 1], path(beside, beside)[..., 1])


@pytest.mark.parametrize("delay_rows", [0.0, 0.4, 2.7])
def test_without_a_limit_the_mean_needs_no_path(delay_rows):
    """Rounded, late and of a drifting clock; a limit of speed is not seen."""
    rng = np.random.default_rng(3)
    t_s = DT * (ROWS + 0.3 * rng.uniform(size=len(ROWS)))
    held, sent = held_targets(t_s, rng.normal(size=len(ROWS)), DT * ROWS, 4)
    params = {
        "transport_delay": {"delay_s": jnp.array([delay_rows * DT])},
        "clock_drift": {"drift_ppm": jnp.array([2e3])},
        "command_quantization": {"step_rad": jnp.array([0.2])},
    }
    rows = jnp.array(held[..., None]), jnp.array(sent[..., None])
    quick = np.asarray(held_command(*rows, params, DT))
    path = np.asarray(command_path(*rows, params, DT).mean)
    assert quick == pytest.approx(path, abs=1e-4)
    slow = params | {"slew_limit": {"speed_rad_s": jnp.array([1.0])}}
    assert not np.allclose(quick, command_path(*rows, slow, DT).mean, atol=0.1)
