"""A first drive.yaml from records of servos that are integrated here."""

import io

import numpy as np
import pytest
from support.cascade_rig import exact_log, stand_of

from benchmarks.diagnosis.hidden.believed import believed
from envs.config.typed import load_yaml
from envs.errors import InputError
from envs.physics.quiet_mujoco import mujoco
from fingers_mjx.cli.main import main
from sysid.description.describe import describe
from sysid.description.law import regression
from sysid.description.proposal import answered
from sysid.description.text import drive_text
from sysid.drive import DriveFile
from sysid.logs.csv_file import write_csv
from sysid.logs.log import make_log

ROW_S, DT = 0.01, 0.0005
KP, KD, COULOMB, WEIGHT, INERTIA = 12.0, 0.5, 0.03, 0.075, 0.01325
ARM = """
<mujoco><worldbody><body><joint name="servo" axis="0 1 0" armature="0.002"/>
<inertial pos="0 0 -0.15" mass="0.5" diaginertia="1e-5 1e-5 1e-5"/>
</body></worldbody>{}</mujoco>"""
T_S = np.arange(0.0, 20.0, ROW_S)
SINES = 1.0 * np.sin(2.0 * T_S) * np.cos(0.5 * T_S) + 0.3 * np.sin(7.0 * T_S)
STEPS = np.sign(np.sin(0.7 * T_S)) + 0.3 * np.sign(np.sin(1.9 * T_S))


def model(more=""):
    return mujoco.MjModel.from_xml_string(ARM.format(more))


def record(cmd=SINES, gain=1.0, own_speed=np.inf, **columns):
    """A servo, perhaps with a speed of its own; `columns` make those of its torque."""
    q = v = follow = 0.0
    angle, torque = [], []
    noise = np.random.default_rng(3)
    for target in cmd:
        read = KP * gain * (follow - q) - KD * v
        angle.append(q + 1e-4 * noise.normal())
        torque.append(read)
        for _ in range(round(ROW_S / DT)):
            step = own_speed * DT
            follow += np.clip(target - follow, -step, step)
            drive = KP * gain * (follow - q)
            rest = drive - WEIGHT * 9.81 * np.sin(q)
            v = (v + DT * rest / INERTIA) / (1.0 + DT * KD / INERTIA)
            v = np.sign(v) * max(abs(v) - COULOMB * DT / INERTIA, 0.0)
            q += DT * v
    named = {f"{k}.servo": make(np.array(torque)) for k, make in columns.items()}
    both = {"cmd.servo": cmd, "pos.servo": np.array(angle)}
    return make_log(("servo",), T_S, both | named, settings={"gain": gain})


def some_rows(log, rows):
    columns = {name: values[rows] for name, values in log.columns.items()}
    return make_log(("servo",), log.t_s[rows], columns)


def described(*logs, more=""):
    (found,) = describe(logs, model(more))
    return found


def test_gains_and_unit_of_a_torque():
    found = described(record(tau=lambda nm: nm))
    assert found.drive.effort == "tau"
    assert found.drive.effort_scale.value == 1.0
    assert found.drive.known == "both"
    assert found.drive.kp.value == pytest.approx(KP, rel=0.1)
    assert found.drive.kd.value == pytest.approx(KD, rel=0.2)
    assert found.drive.kp.free


@pytest.mark.parametrize(
    ("unit", "size"),
    [
        ("kgf·cm", 0.0980665),
        ("N·cm", 0.01),
        ("ozf·in", 0.00706155),
        ("mN·m", 1e-3),
    ],
)
def test_other_units_of_a_torque_are_recognized(unit, size):
    found = described(record(tau=lambda nm: nm / size))
    assert found.drive.effort_scale.value == size
    assert found.why["effort_scale"].startswith(unit)
    assert found.drive.kp.value == pytest.approx(KP, rel=0.1)


@pytest.mark.parametrize(("unit", "size"), [("N·cm", 0.01), ("ozf·in", 0.00706155)])
def test_the_nearest_unit_counts_where_masses_are_off(unit, size):
    """These two are 1.4 apart: what lies between is of the nearer one."""
    between = {"N·cm": 1.1, "ozf·in": 0.9}[unit]
    found = described(record(tau=lambda nm: nm / size * between))
    assert found.drive.effort_scale.value == size
    assert found.why["effort_scale"].startswith(unit)


def test_a_current_gets_its_torque_constant():
    found = described(record(cur=lambda nm: nm / 0.37))
    assert found.drive.effort == "cur"
    assert found.drive.effort_scale.value == pytest.approx(0.37, rel=0.05)


def test_a_current_without_sign_is_no_effort():
    found = described(record(cur=np.abs))
    assert found.drive.effort == "none"
    assert "cur.servo without sign" in found.why["effort"]


def test_gains_without_effort_come_from_the_masses():
    found = described(record())
    assert found.drive.effort == "none"
    assert found.drive.kp.value == pytest.approx(KP, rel=0.25)
    assert "friction" in found.why["kd"]


def test_an_effort_that_no_gain_makes_leaves_the_mechanics():
    log = record(tau=lambda nm: nm)
    columns = dict(log.columns) | {"cmd.servo": log.column("pos.servo")}
    driven = make_log(("servo",), log.t_s, columns)
    assert described(driven).drive.known == "mechanics"
    rng = np.random.default_rng(0)
    other = np.cumsum(0.01 * rng.normal(size=len(log)))
    columns = dict(log.columns) | {"cmd.servo": other}
    assert described(make_log(("servo",), log.t_s, columns)).drive.known == "mechanics"


def test_an_effort_of_two_loops_leads_to_the_cascade():
    stand = stand_of(1)
    (found,) = describe([exact_log(stand, 1)], believed(stand).model)
    assert found.drive.known == "mechanics"
    assert "`cascade`" in found.why["known"]
    assert "cascade" not in described(record(tau=lambda x: x)).why["known"]


def test_a_joint_that_rests_shows_nothing():
    found = described(record(cmd=np.zeros(len(T_S))))
    assert found.drive.kp.free
    assert found.why["kp"] == "the record does not show it"


@pytest.mark.parametrize(
    ("column", "made"),
    [
        ("none", record),
        ("tau", lambda: record(tau=lambda nm: nm)),
        ("cur", lambda: record(cur=lambda nm: nm)),
    ],
)
def test_a_joint_that_never_rests_in_rows_of_10_hz(column, made):
    log = made()
    for every in (10, 15, 20):
        found = described(some_rows(log, slice(None, None, every)))
        assert found.drive.effort == column
        assert found.drive.kp.free
        assert found.why["kp"] == "the record does not show it"
        said = f"rows {10 * every} ms apart show rests alone"
        assert found.why["known"] == f"{said}, of which there are too few"
        assert found.suggested == ()
        if column != "none":
            assert found.drive.effort_scale.free == (column == "cur")
            assert found.why["effort_scale"] == "too few rows count to show it"


def test_rests_in_rows_of_10_hz_show_the_gain():
    log = record(cmd=STEPS, own_speed=0.8, tau=lambda nm: nm)
    found = described(some_rows(log, slice(None, None, 10)))
    assert found.drive.known == "controller"
    assert found.drive.kp.value == pytest.approx(KP, rel=0.1)


def test_rests_show_no_path_of_the_targets():
    log = record(cmd=STEPS, own_speed=0.3, tau=lambda nm: nm)
    assert described(some_rows(log, slice(None, None, 5))).suggested == ()


def test_a_record_that_is_too_short_says_nothing():
    log = record(tau=lambda nm: nm)
    found = described(some_rows(log, slice(0, 160, 2)))
    assert found.drive.known == "both"
    assert found.why["known"] == "too few rows count to say otherwise"
    assert found.why["effort_scale"] == "too few rows count to show it"


def test_a_setting_that_multiplies_the_gain():
    logs = [record(gain=g, tau=lambda nm: nm) for g in (0.6, 1.0, 1.8)]
    found = described(*logs)
    assert found.drive.kp_setting == "gain"
    assert found.drive.kp.value == pytest.approx(KP, rel=0.1)


def test_a_servo_with_a_speed_of_its_own():
    suggested = described(record(cmd=STEPS, own_speed=2.0)).suggested
    (line,) = [x for x in suggested if x.startswith("slew_limit")]
    assert float(line.split("value: ")[1].split(",")[0]) == pytest.approx(2.0, rel=0.1)
    freely = described(record(cmd=STEPS)).suggested
    assert not [x for x in freely if x.startswith("slew_limit")]


def test_opposite_directions_are_refused():
    with pytest.raises(InputError, match=r"tau\.servo.*direction of the angle"):
        described(record(tau=lambda nm: -nm))
    log = record()
    turned = {
        "cmd.servo": -log.column("cmd.servo"),
        "pos.servo": log.column("pos.servo"),
    }
    with pytest.raises(InputError, match=r"pos\.servo.*one direction"):
        described(make_log(("servo",), log.t_s, turned))


def test_gains_of_an_actuator_count():
    more = '<actuator><position name="a" joint="servo" kp="9" kv="0.4"/></actuator>'
    found = described(record(), more=more)
    assert (found.drive.kp.value, found.drive.kd.value) == (9.0, 0.4)
    assert not found.drive.kp.free
    assert found.why["kp"] == "actuator a of the MJCF file"


def test_what_an_owner_knows():
    found = described(record(tau=lambda nm: nm))
    known = answered(answered(found, "kp", "11.5"), "known", "y")
    assert (known.drive.kp.value, known.drive.kp.free) == (11.5, False)
    assert known.drive.known == "controller"
    for field, text in (("kp", "-1"), ("kp", "many"), ("known", "perhaps")):
        with pytest.raises(InputError, match=field):
            answered(found, field, text)


def test_the_text_is_a_drive_file(tmp_path):
    found = described(record(cmd=STEPS, own_speed=2.0, tau=lambda nm: nm))
    path = tmp_path / "drive.yaml"
    path.write_text(drive_text([found], "knee.csv"), encoding="utf-8")
    assert load_yaml(DriveFile, path).joints == {"servo": found.drive}
    assert "# `masses: {tolerance: …}`, 5% are expected." in path.read_text("utf-8")
    taken = path.read_text().replace("# effects", "effects").replace("#   ", "  ")
    path.write_text(taken)
    assert "slew_limit" in load_yaml(DriveFile, path).joints["servo"].effects


@pytest.mark.parametrize("rest", ["\n\nn\n", ""], ids=["answered", "ended"])
def test_the_command_asks_on_a_terminal(tmp_path, monkeypatch, capsys, rest):
    """An input that ends (Ctrl-D) keeps what is proposed, as an empty answer does."""
    log, mjcf = tmp_path / "knee.csv", tmp_path / "knee.xml"
    write_csv(record(tau=lambda nm: nm), log)
    mjcf.write_text(ARM.format(""))
    typed = io.StringIO(f"zero\n11.5\n{rest}")
    typed.isatty = lambda: True
    monkeypatch.setattr("sys.stdin", typed)
    out = tmp_path / "drive.yaml"
    command = ["sysid", "describe", str(log), "--mjcf", str(mjcf), "-o", str(out)]
    assert main(command) == 0
    drive = load_yaml(DriveFile, out).joints["servo"]
    assert (drive.kp.value, drive.known) == (11.5, "both")
    said = capsys.readouterr().out
    assert "a positive number" in said
    assert f"--mjcf {mjcf} --drive {out}" in said
    assert main(command) == 2  # never over a file that is there


def test_regression_knows_how_certain_it_is():
    """Standard errors of the jackknife against the spread over many draws."""
    x = np.sin(np.arange(400.0))[:, None]
    drawn = [
        regression(x, 2.0 * x[:, 0] + np.random.default_rng(k).normal(size=400))
        for k in range(300)
    ]
    spread = np.std([found.theta[0] for found in drawn])
    assert np.mean([found.sd[0] for found in drawn]) == pytest.approx(spread, rel=0.2)
