"""The hidden simulator against physics that anybody can work out on paper."""

import ast
import math
from dataclasses import replace
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

from benchmarks.diagnosis import hidden
from benchmarks.diagnosis.hidden.cases import draw_case
from benchmarks.diagnosis.hidden.joint_drive import JointDrive, _Bristle, _Jenkins
from benchmarks.diagnosis.hidden.recording import Recording, standard
from benchmarks.diagnosis.hidden.sampling import Noise, exact, record
from benchmarks.diagnosis.hidden.simulate import simulate
from benchmarks.diagnosis.hidden.truth import Joint, Link, Mechanism
from envs.actuator.catalogue import CATALOGUE
from envs.actuator.chain import JointInput, chain_step

FOLDER = Path(hidden.__file__).parent
WEIGHT = Link(
    name="servo",
    pos=(0.0, 0.0, 0.0),
    quat=(1.0, 0.0, 0.0, 0.0),
    axis=(0.0, 1.0, 0.0),
    mass=0.2,
    com=(0.0, 0.0, -0.1),
    inertia_quat=(1.0, 0.0, 0.0, 0.0),
    inertia=(1e-4, 1e-4, 1e-4),
    range_rad=(-2.0, 2.0),
)
WEIGHTLESS = replace(WEIGHT, com=(0.0, 0.0, 0.0))
KP, KD = 4.0, 0.1
MGL = 0.2 * 9.81 * 0.1


def servo(link=WEIGHTLESS, delay_s=0.0, lowpass_hz=1e3, **effects):
    joint = Joint(KP, KD, 1e-3, delay_s, lowpass_hz, effects=effects)
    return Mechanism((link,), (joint,))


def held(mechanism, target, seconds=1.0, start=0.0):
    """Motion under one target; it starts elsewhere."""
    times = np.array([0.0, seconds])
    targets = np.full((2, 1), float(target))
    return simulate(mechanism, times, targets, np.array([start]))


def test_nothing_is_shared_with_what_is_tested():
    forbidden = ("envs.actuator.effects", "envs.hand.drive.servo", "sysid.")
    for file in FOLDER.glob("*.py"):
        for node in ast.walk(ast.parse(file.read_text())):
            names = [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            # What is believed is handed over in the product's terms.
            allowed = ("sysid.drive", "sysid.logs.log", "sysid.mechanism")
            bad = [n for n in names if n.startswith(forbidden) and n not in allowed]
            assert not bad, file.name


def test_a_weight_hangs_where_servo_and_gravity_agree():
    motion = held(servo(WEIGHT), 0.8, 2.0)
    angle = motion.angle[-1, 0]
    assert KP * (0.8 - angle) == pytest.approx(MGL * math.sin(angle), rel=1e-3)
    assert motion.torque[-1, 0] == pytest.approx(MGL * math.sin(angle), rel=1e-3)


def test_command_path_by_its_step_response():
    times, steps = np.array([0.0, 0.1, 1.1]), np.array([[0.0], [1.0], [1.0]])

    def commands(mechanism):
        drive = JointDrive(
            mechanism.joints[0], times.tolist(), steps[:, 0].tolist(), 5e-4
        )
        found = []
        for k in range(2000):
            drive.drive(k * 5e-4, 0.0, 0.0, 1.0)
            found.append(drive.command)
        return np.array(found)

    late = commands(servo(delay_s=0.0195))
    assert np.argmax(late > 0.0) * 5e-4 == pytest.approx(0.1195, abs=6e-4)
    smooth = commands(servo(lowpass_hz=3.0))
    after = round((0.1 + 1.0 / (2.0 * math.pi * 3.0)) / 5e-4)
    assert smooth[after] == pytest.approx(1.0 - math.exp(-1.0), abs=0.005)
    slow = commands(servo(slew_limit={"speed_rad_s": 2.0}))
    assert np.max(np.diff(slow)) == pytest.approx(2.0 * 5e-4)
    assert np.argmax(slow > 0.999) * 5e-4 == pytest.approx(0.6, abs=0.002)
    gentle = {"acceleration_limit": {"acceleration_rad_s2": 10.0}}
    soft = commands(
        servo(slew_limit={"speed_rad_s": 2.0}, lowpass_hz=math.inf, **gentle)
    )
    assert np.max(np.abs(np.diff(soft, 2))) == pytest.approx(10.0 * 5e-4**2)
    assert np.max(np.diff(soft)) == pytest.approx(2.0 * 5e-4)
    # 1 rad at 2 rad/s, and 0.2 s more to get there and to brake.
    assert np.argmax(soft > 1.0 - 1e-6) * 5e-4 == pytest.approx(0.8, abs=0.002)
    assert np.max(soft) < 1.0 + 1e-9
    free = commands(servo(lowpass_hz=math.inf, **gentle))
    top = np.max(np.diff(free)) / 5e-4
    assert top == pytest.approx(math.sqrt(10.0), rel=0.01)


def test_two_loops_hold_a_weight_and_keep_to_their_speed():
    """No error is left, the joint moves at the speed asked for, and at the torque
    limit nothing winds up: it comes back at once."""
    loops = {"k_int": 4.0, "ref_rad_s": 0.5}
    joint = Joint(KP, 0.4, 1e-3, 0.0, 1e3, **loops)
    motion = held(Mechanism((WEIGHT,), (joint,)), 0.8, 4.0)
    assert motion.angle[-1, 0] == pytest.approx(0.8, abs=1e-3)
    assert motion.torque[-1, 0] == pytest.approx(MGL * math.sin(0.8), rel=1e-3)
    assert np.max(motion.speed[500:, 0]) == pytest.approx(0.5, rel=0.05)
    weak = Mechanism((WEIGHT,), (replace(joint, limit_nm=0.5 * MGL),))
    times, targets = np.array([0.0, 3.0, 4.0]), np.array([[1.4], [0.0], [0.0]])
    motion = simulate(weak, times, targets, np.array([0.0]))
    back = motion.torque[round(3.02 / 4.02 * len(motion.t_s)), 0]
    assert np.max(motion.torque) == pytest.approx(0.5 * MGL)
    assert back < 0.25 * MGL


@pytest.mark.parametrize(
    "effects",
    [
        {"coulomb_friction": {"torque_nm": 0.05}},
        {"asymmetric_friction": {"difference_nm": 0.1}},
        {"stribeck_friction": {"extra_nm": 0.05, "speed_rad_s": 0.1}},
        {"load_friction": {"drive_share": 1.5, "load_share": 0.0}},
    ],
    ids=lambda x: next(iter(x)),
)
def test_dry_friction_holds_what_is_weaker(effects):
    """Pushed with 0.04 N·m a joint creeps at most by its bristles; with 0.08 it goes,
    unless friction grows with the push."""
    weak = held(servo(**effects), 0.04 / KP)
    assert abs(weak.angle[-1, 0]) < 5e-4
    strong = held(servo(**effects), 0.08 / KP)
    moved = strong.angle[-1, 0] > 2e-3
    assert moved == ("load_friction" not in effects)


def test_friction_that_knows_directions():
    one_way = servo(asymmetric_friction={"difference_nm": 0.1})
    back = held(one_way, -0.02)
    assert back.angle[-1, 0] == pytest.approx(-0.02, abs=2e-3)
    with_dry = servo(
        asymmetric_friction={"difference_nm": 0.04}, coulomb_friction={"torque_nm": 0.1}
    )
    for target, bound in ((0.2, 0.12), (-0.2, 0.08)):
        rest = held(with_dry, target).torque[-1, 0]
        assert abs(rest) <= bound + 1e-3


@pytest.mark.parametrize("difference", [-0.06, 0.06])
@pytest.mark.parametrize("speed", [-0.7, 0.7])
def test_directions_have_the_sign_of_the_catalogue(difference, speed):
    """Both simulators resist by the same torque, in the same direction."""
    values = {"difference_nms": difference}, {"difference_nm": difference}
    hidden = (
        servo(asymmetric_viscous=values[0]),
        servo(asymmetric_friction=values[1]),
    )
    for effect, known, truth in zip(
        ("asymmetric_viscous", "asymmetric_friction"), values, hidden, strict=True
    ):
        drive = JointDrive(truth.joints[0], [0.0], [0.0], 5e-4)
        force = 0.0
        for _ in range(2000):
            force = drive.resist(0.0, speed, 0.0)
        model = [(CATALOGUE[effect], {k: jnp.asarray(v) for k, v in known.items()})]
        qd, none = jnp.asarray(speed), jnp.asarray(0.0)
        joint = JointInput(none, none, qd, none, KP, KD)
        x = chain_step(model, ((),), joint, 5e-4)[1]
        resists = -x.viscous * speed - x.friction * np.sign(speed)
        assert force == pytest.approx(float(resists), abs=1e-4)
        assert (abs(force) > 0.01) == (difference * speed > 0.0)


def test_bristles_slip_at_the_stribeck_curve():
    joint = servo(stribeck_friction={"extra_nm": 0.05, "speed_rad_s": 0.1}).joints[0]
    for speed in (0.01, 0.1, 0.3):
        bristle = _Bristle(joint, 5e-4)
        for _ in range(2000):
            force = bristle.force(speed, 0.0, 0.0)
        assert force == pytest.approx(-0.05 * math.exp(-((speed / 0.1) ** 2)), rel=1e-3)


def test_hysteresis_takes_energy_in_every_closed_loop_and_is_bounded():
    joint = servo(hysteresis={"torque_nm": 0.03, "range_rad": 0.02}).joints[0]
    for size in (0.001, 0.02, 0.3):
        loop = _Jenkins(joint)
        q = size * np.sin(np.linspace(0.0, 4.0 * math.pi, 4001))
        force = np.array([loop.force(x) for x in q])
        work = -np.sum(force[2001:] * np.diff(q[2000:]))
        assert work >= 0.0
        assert np.max(np.abs(force)) <= 0.03 + 1e-12
    assert work == pytest.approx(4.0 * 0.3 * 0.03, rel=0.3)


def test_play_and_compliance_part_motor_and_link():
    """A weight pulls the link through the play; a spring gives by load / stiffness."""
    play = held(servo(WEIGHT, backlash={"gap_rad": 0.04}), 0.8, 2.0)
    assert play.encoder[-1, 0] - play.angle[-1, 0] == pytest.approx(0.02, abs=1e-3)
    other = held(servo(WEIGHT, backlash={"gap_rad": 0.04}), -0.8, 2.0)
    assert other.encoder[-1, 0] - other.angle[-1, 0] == pytest.approx(-0.02, abs=1e-3)
    soft = {"stiffness_nm_rad": 10.0, "damping_nms_rad": 0.05}
    spring = held(servo(WEIGHT, compliance=soft), 0.8, 2.0)
    stretch = spring.encoder[-1, 0] - spring.angle[-1, 0]
    assert stretch == pytest.approx(spring.torque[-1, 0] / 10.0, rel=0.01)


def test_warm_motors_settle_at_their_heat_balance():
    heat = {"fall_per_nm2s": 2.0, "cooling_per_s": 4.0}
    motion = held(servo(WEIGHT, thermal_derating=heat), 1.2, 5.0)
    torque, angle = motion.torque[-1, 0], motion.angle[-1, 0]
    strength = torque / (KP * (1.2 - angle))
    assert 1.0 / strength - 1.0 == pytest.approx(2.0 * torque**2 / 4.0, rel=0.01)


def test_a_supply_sags_by_what_is_asked_of_it():
    weak = replace(servo(WEIGHT), sag_per_nm=2.0)
    motion = held(weak, 1.2, 2.0)
    asked = KP * (1.2 - motion.angle[-1, 0])
    assert motion.torque[-1, 0] == pytest.approx(asked / (1.0 + 2.0 * asked), rel=0.01)


def test_encoders_and_loads_by_their_static_error():
    turned = held(servo(encoder_offset={"offset_rad": 0.1}), 0.5)
    assert turned.angle[-1, 0] == pytest.approx(0.4, abs=1e-3)
    assert turned.encoder[-1, 0] == pytest.approx(0.5, abs=1e-3)
    scaled = held(servo(encoder_scale={"scale": 1.25}), 0.5)
    assert scaled.angle[-1, 0] == pytest.approx(0.4, abs=1e-3)
    tilted = replace(servo(WEIGHT), tilt_rad=(0.0, 0.3))
    assert abs(held(tilted, 0.0, 2.0).torque[-1, 0]) > 0.9 * MGL * math.sin(0.28)
    heavy = replace(servo(WEIGHT), payload_kg=(0.2,))
    assert held(heavy, 0.8, 2.0).torque[-1, 0] == pytest.approx(
        2.0 * MGL * math.sin(held(heavy, 0.8, 2.0).angle[-1, 0]), rel=1e-3
    )


def test_a_log_scatters_as_its_noise_says():
    rng = np.random.default_rng(3)
    recording = standard(rng, np.array([0.0]), np.array([0.3]), round_s=6.0)
    noise = Noise(start_rad=0.0)
    log = record(servo(WEIGHT, 0.019, 3.0), recording, noise, rng)
    angle, torque, _ = exact(servo(WEIGHT, 0.019, 3.0), recording, log.t_s[:1])[:3]
    assert len(recording.targets) > len(log) > 0.97 * len(recording.targets)
    assert np.max(np.diff(log.t_s)) > 0.03
    rounds = log.column("cmd.servo")
    assert 0.0005 < np.mean(log.missing("pos.servo")) < 0.02
    assert np.ptp(rounds) == pytest.approx(0.6, rel=0.02)
    assert angle.shape == torque.shape == (1, 1)
    still = Recording(200.0, np.zeros((800, 1)), (("hold", 0, 0, 800),))
    quiet = record(servo(WEIGHT, 0.019, 3.0), still, noise, rng)
    found = [np.nanstd(quiet.column(f"{q}.servo")) for q in ("pos", "tau")]
    assert found == pytest.approx(noise.deviations(), rel=0.15)


def test_cases_reach_their_visibility_and_repeat_exactly():
    case = draw_case(4, ("coulomb_friction",), "medium", round_s=6.0, lowpass_hz=3.0)
    assert case.ratio == pytest.approx(2.0, rel=0.06)
    again = draw_case(4, ("coulomb_friction",), "medium", round_s=6.0, lowpass_hz=3.0)
    assert again.logs[0].sha256 == case.logs[0].sha256
    none = draw_case(4, (), round_s=6.0, lowpass_hz=3.0)
    assert none.truth.joints[0].effects == {}
    assert none.truth != none.stand.mechanism


def test_a_limit_out_of_reach_leaves_no_trace():
    free = draw_case(6, (), round_s=6.0, lowpass_hz=3.0)
    limited = draw_case(6, ("torque_limit",), "invisible", round_s=6.0, lowpass_hz=3.0)
    times = np.arange(0.0, 4.0, 0.005)
    targets = limited.logs[0].column("cmd.servo")[: times.size, None]
    recording = Recording(200.0, targets, (("x", 0, 0, times.size),))
    with_limit = exact(limited.truth, recording, times)
    joint = replace(limited.truth.joints[0], effects={})
    without = exact(limited.truth.with_joint(0, joint), recording, times)
    for a, b in zip(with_limit, without, strict=True):
        assert np.array_equal(a, b)
    assert free.effects == ()
