"""Table I is recovered from logs of the second simulator."""

import dataclasses
import json

import numpy as np
import pytest

from benchmarks.diagnosis.hidden.pull import SPEED_M_S, pull
from benchmarks.diagnosis.hidden.recording import standard
from benchmarks.diagnosis.hidden.sampling import Noise, record
from benchmarks.diagnosis.hidden.stands import make_stand, slightly_wrong
from envs.errors import InputError
from envs.hand.hand_file import load_hand_file, save_hand_file
from sysid.calibration.calibrate import calibrate, calibrated_hand, weighed_mean
from sysid.calibration.friction import pull_of
from sysid.calibration.plots import write_plots
from sysid.logs.log import make_log
from sysid.mechanism import hand_mechanism

NOISE = Noise(torque_sd_nm=2e-3)
FRICTION = 0.88


@pytest.fixture(scope="module")
def hidden():
    """A finger that is not as believed, and a log of two of its joints."""
    rng = np.random.default_rng(12)
    stand = make_stand("finger", rng, lowpass_hz=3.0)
    truth = slightly_wrong(stand.mechanism, rng)
    for i, factor in enumerate((1.0, 0.8, 1.3, 1.0)):
        joint = truth.joints[i]
        wrong = dataclasses.replace(joint, kp=factor * joint.kp, delay_s=0.024)
        truth = truth.with_joint(i, dataclasses.replace(wrong, lowpass_hz=3.4))
    logs = []
    for moved in (1, 2):
        reach = np.where(np.arange(4) == moved, stand.reach, 0.0)
        recording = standard(rng, stand.middle, reach, 200.0, 10.0, 2)
        quat = stand.mechanism.base_quat_w
        logs.append(record(truth, recording, NOISE, rng, palm_quat_w=quat))
    pulls = [pull(FRICTION, normal, rng) for normal in (0.8, 1.5, 2.5)]
    return truth, stand.names, [*logs, *pulls]


@pytest.fixture(scope="module")
def found(hidden):
    return calibrate(hidden[2], hand_mechanism())


def test_table_one_is_recovered_with_intervals_that_cover(hidden, found):
    truth, names, _ = hidden
    assert set(found.joints) == {names[1], names[2]}
    for i in (1, 2):
        fit, true = found.joints[names[i]], truth.joints[i]
        believed = hand_mechanism().drives[names[i]]
        scale = true.kp / believed.kp.value
        assert fit.values["stiffness"] == pytest.approx(scale, rel=0.05)
        assert fit.low["stiffness"] <= scale <= fit.high["stiffness"]
        assert fit.values["speed_limit"] == pytest.approx(true.slew_rad_s, rel=0.05)
        assert fit.rms["pos"] < 1e-3
    shared = found.shared
    # The joints' own delays and cutoffs differ by a few percent, as real ones do.
    delays = [truth.joints[i].delay_s for i in (1, 2)]
    assert shared["delay_s"].value == pytest.approx(np.mean(delays), abs=1e-3)
    assert shared["delay_s"].low <= np.mean(delays) <= shared["delay_s"].high
    assert shared["lowpass_hz"].value == pytest.approx(3.4, rel=0.05)
    for name, i in (("speed_abduction", 1), ("speed_flexion", 2)):
        true = truth.joints[i].slew_rad_s
        assert shared[name].value == pytest.approx(true, rel=0.05)
        assert shared[name].low <= true <= shared[name].high
    assert shared["tip_friction"].value == pytest.approx(FRICTION, rel=0.05)
    assert shared["tip_friction"].low <= FRICTION <= shared["tip_friction"].high


def test_the_hand_file_has_it_with_its_provenance(found, hidden, tmp_path):
    hand, old = calibrated_hand(load_hand_file(), found), load_hand_file()
    save_hand_file(hand, tmp_path / "hand.yaml")
    assert load_hand_file(tmp_path / "hand.yaml") == hand
    source = f"identified from {found.digest}"
    for quantity in (hand.stiffness_scale, hand.delay_s, hand.lowpass_hz):
        assert quantity.source == source
    assert hand.tip_friction.source == source
    names = list(hand_mechanism().joints)
    moved = [names.index(hidden[1][i]) for i in (1, 2)]
    new, was = (h.per_joint("stiffness_scale") for h in (hand, old))
    assert np.flatnonzero(new != was).tolist() == moved
    assert new[moved[1]] / was[moved[1]] == pytest.approx(1.3, rel=0.1)
    assert hand.palm_mass == old.palm_mass


def test_pictures_and_figures_are_written(found, tmp_path):
    paths = write_plots(found, tmp_path)
    assert {path.stem for path in paths} == {*found.joints, "pulls", "table1"}
    assert all(path.stat().st_size > 5000 for path in paths)
    data = json.loads(found.to_json())
    assert len(data["pulls"]) == 3
    assert data["shared"]["delay_s"]["unit"] == "s"


def test_a_shared_mean_is_as_wide_as_its_parts_scatter():
    alike = weighed_mean(np.array([1.0, 1.0, 1.0]), np.array([0.1, 0.1, 0.1]), "1")
    assert alike.high - alike.value == pytest.approx(1.96 * 0.1 / np.sqrt(3))
    apart = weighed_mean(np.array([0.5, 1.0, 1.5]), np.array([0.01] * 3), "1")
    assert apart.value == pytest.approx(1.0)
    assert apart.high - apart.value == pytest.approx(4.303 * 0.5 / np.sqrt(3), rel=0.02)
    sure = weighed_mean(np.array([1.0, 2.0]), np.array([0.01, 1.0]), "1")
    assert sure.value == pytest.approx(1.0, abs=0.01)


def test_friction_is_read_while_the_tip_slides(hidden):
    one = pull_of(hidden[2][-1])
    assert one.start_s > 0.5 + FRICTION * 2.5 / 800.0 / SPEED_M_S
    assert 3.0 < one.stop_s < 3.5
    light = pull_of(hidden[2][2])  # its force falls below half while it chatters
    assert light.stop_s - light.start_s > 2.0
    log = hidden[2][-1]
    columns = {k: v for k, v in log.columns.items() if not k.startswith("force")}
    bare = make_log(("tip",), log.t_s, columns, settings={"normal_n": 1.0})
    with pytest.raises(InputError, match=r"force\.<finger>"):
        pull_of(bare)


def test_what_cannot_be_calibrated_is_refused():
    t_s = np.arange(200) * 0.01
    still = {"cmd.finger2_joint3": np.zeros(200), "pos.finger2_joint3": np.zeros(200)}
    with pytest.raises(InputError, match="nothing that moves"):
        calibrate([make_log(("finger2_joint3",), t_s, still)], hand_mechanism())
    moved = {name: np.sin(t_s) for name in still}
    walking = make_log(("finger2_joint3",), t_s, moved, mounting="free")
    with pytest.raises(InputError, match="palm_fixed"):
        calibrate([walking], hand_mechanism())
    with pytest.raises(InputError, match="at least 50"):
        short = {name: values[:40] for name, values in moved.items()}
        calibrate([make_log(("finger2_joint3",), t_s[:40], short)], hand_mechanism())


def test_a_record_of_a_joint_that_the_mechanism_lacks_is_refused_by_name():
    t_s = np.arange(50) * 0.01
    wave = 0.1 * np.sin(10 * t_s)
    log = make_log(("elbow",), t_s, {"cmd.elbow": wave, "pos.elbow": wave})
    with pytest.raises(InputError, match="joints: found elbow; valid: one of"):
        calibrate([log], hand_mechanism())
