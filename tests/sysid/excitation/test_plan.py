import numpy as np
import pytest

from benchmarks.diagnosis.hidden.believed import believed
from benchmarks.diagnosis.hidden.stands import make_stand
from envs.errors import InputError
from envs.physics.quiet_mujoco import mujoco
from sysid.drive import JointDrive, Nominal
from sysid.excitation.check import fitting_plan, rehearse
from sysid.excitation.files import separation_lines, write_plan
from sysid.excitation.plan import Limits, Schedule, make_plan
from sysid.excitation.separation import separation
from sysid.excitation.waves import WAVES, multisine_lines
from sysid.mechanism import hand_mechanism, joint_groups, model_mechanism, rest_posture

TWO_ARMS = """
<mujoco><compiler angle="radian"/><worldbody>
  <body name="a"><joint name="a" axis="0 0 1" range="-1.5 1.5" limited="true"
    armature="0.001"/>
    <geom type="capsule" fromto="0 0 0 0.1 0 0" size="0.01" mass="0.05"/></body>
  <body name="b" pos="0 {apart} 0"><joint name="b" axis="0 0 1" range="-1.5 1.5"
    limited="true" armature="0.001"/>
    <geom type="capsule" fromto="0 0 0 0.1 0 0" size="0.01" mass="0.05"/></body>
</worldbody></mujoco>
"""


def arms(apart=1.0, limit=1.0):
    """Two parallel arms of 10 cm."""
    model = mujoco.MjModel.from_xml_string(TWO_ARMS.format(apart=apart))
    effects = {"torque_limit": {"limit_nm": Nominal(limit)}}
    return model_mechanism(
        model, {"*": JointDrive(Nominal(4.0), Nominal(0.1), effects=effects)}
    )


def pendulum():
    return believed(make_stand("pendulum", np.random.default_rng(2)))


@pytest.mark.parametrize("name", list(WAVES))
def test_waves_go_from_rest_to_rest_within_one(name):
    rng = np.random.default_rng(1)
    wave = WAVES[name].shape(8.0, 100.0, rng)
    assert wave.shape == (800,)
    assert 0.9 < np.max(np.abs(wave)) <= 1.0 + 1e-9
    if not WAVES[name].jumps:
        ends = np.abs([wave[0], wave[-1]])
        assert np.all(ends <= np.max(np.abs(np.diff(wave))) + 1e-9)


def test_a_multisine_has_its_odd_lines_and_no_other():
    wave = WAVES["multisine"].shape(16.0, 100.0, np.random.default_rng(4))
    period = wave[400:1400:][:200]
    assert np.allclose(period, wave[600:800])  # exact repetition
    spectrum = np.abs(np.fft.rfft(period))
    lines = np.flatnonzero(spectrum > 1e-6 * spectrum.max())
    assert np.all(lines % 2 == 1)
    chosen = multisine_lines(2.0, 100.0, np.random.default_rng(4))
    assert lines.tolist() == chosen.tolist()
    silent = set(range(1, int(chosen.max()), 2)) - set(lines.tolist())
    assert silent  # odd lines left free to show odd nonlinearity


def test_repeats_are_exact_and_groups_move_alone():
    mechanism = arms()
    twice = Schedule(("steps", "ramps"), repeats=2)
    plan = make_plan(mechanism, [("a",), ("b",)], twice)
    assert plan.moved == ("a", "b")
    first, second = (s for s in plan.segments[:2])
    a, b = (round(s.start_s * 100) for s in (first, second))
    rows = round((first.stop_s - first.start_s) * 100)
    assert np.array_equal(plan.targets[a : a + rows], plan.targets[b : b + rows])
    for segment in plan.segments:
        still = 1 - plan.joints.index(segment.joints[0])
        inside = slice(round(segment.start_s * 100), round(segment.stop_s * 100))
        assert np.ptp(plan.targets[inside, still]) == 0.0
    steps, others = (Schedule(("steps",), seed=seed) for seed in (0, 3))
    again = make_plan(mechanism, [("a",)], others).targets
    assert not np.array_equal(again, make_plan(mechanism, [("a",)], steps).targets)


def test_speed_position_and_torque_stay_inside():
    limits = Limits(speed_rad_s=1.5, margin_rad=0.1, reach_rad=0.4)
    short = Schedule(stretch=0.5)
    plan, found = fitting_plan(arms(limit=0.12), [("a",)], short, limits)
    smooth = [s for s in plan.segments if not WAVES[s.wave].jumps]
    for s in smooth:
        rows = plan.targets[round(s.start_s * 100) : round(s.stop_s * 100), 0]
        assert np.max(np.abs(np.diff(rows))) * 100 <= 1.5 * 1.001
    assert np.max(np.abs(found.torque)) <= 0.9 * 0.12
    assert np.max(np.abs(found.speed)) <= 1.05 * 1.5
    assert np.max(np.abs(found.angle)) <= 1.5
    free = make_plan(arms(limit=0.12), [("a",)], short, limits)
    assert rehearse(arms(limit=0.12), free).broken  # steps had to become smaller
    assert free.segments[9].amplitude_rad["a"] > plan.segments[9].amplitude_rad["a"]


def test_collisions_make_motions_smaller_or_are_refused():
    slow = Schedule(("slow_triangle",), stretch=0.4)
    free, _ = fitting_plan(arms(), [("a",)], slow, Limits())
    assert free.segments[0].amplitude_rad == {"a": 0.5}
    near, found = fitting_plan(arms(apart=0.05), [("a",)], slow, Limits())
    # 3 cm of air at the end of 10 cm of arm
    assert 0.15 < near.segments[0].amplitude_rad["a"] < 0.35
    assert not any(found.touching)
    with pytest.raises(InputError, match="found a and b touch"):
        fitting_plan(arms(apart=0.0205), [("a",)], slow, Limits())


def test_names_that_do_not_exist():
    with pytest.raises(InputError, match=r"joints: found elbow"):
        make_plan(arms(), [("elbow",)])
    with pytest.raises(InputError, match=r"waves: found chirps.*did you mean chirp"):
        make_plan(arms(), [("a",)], Schedule(("chirps",)))
    with pytest.raises(InputError, match="joints: found indx"):
        joint_groups(hand_mechanism(), ["indx"])
    hand = hand_mechanism()
    assert len(joint_groups(hand, ["index", "finger1_joint1"])[0]) == 4
    low = np.array([link.range_rad[0] for link in hand_figures()])
    assert np.all(rest_posture(hand) >= low - 1e-12)


def hand_figures():
    from envs.hand.nominal import vendor_hand

    return vendor_hand().links


def test_what_a_plan_shows_follows_from_the_motion(tmp_path):
    """Slow motion shows friction and hides delay; without motion nothing shows."""
    mechanism = pendulum()
    triangle = Schedule(("slow_triangle",), rate_hz=50)
    slow = make_plan(mechanism, [("servo",)], triangle)
    short = Schedule(rate_hz=50, stretch=0.4)
    rich, found = fitting_plan(mechanism, [("servo",)], short, Limits())
    seen_slow = separation(mechanism, slow, "servo")
    seen_rich = separation(mechanism, rich, "servo")
    assert {"coulomb_friction", "deadband", "stiffness"} <= set(seen_slow.seen)
    assert "torque_limit" not in seen_rich.seen  # never reached: cannot be seen
    small = {n: seen_rich.smallest[n] / seen_slow.smallest[n] for n in seen_slow.seen}
    assert small["transport_delay"] < 0.2
    for name in seen_rich.seen:
        assert name not in seen_rich.confused(name)
    write_plan(rich, found, [seen_rich], tmp_path)
    table = np.loadtxt(tmp_path / "targets.csv", delimiter=",", skiprows=1)
    assert table.shape == (len(rich.targets), 2)
    assert "does not show" in separation_lines(seen_rich)[-1]
    assert "torque_limit" in (tmp_path / "plan.yaml").read_text()
