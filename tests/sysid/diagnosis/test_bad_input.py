"""Records that cannot be diagnosed: one sentence, or a verdict that says so."""

from dataclasses import replace

import numpy as np
import pytest

from envs.errors import InputError
from envs.physics.quiet_mujoco import mujoco
from fingers_mjx.cli.main import main
from sysid.diagnosis.diagnose import diagnose
from sysid.diagnosis.measured.checks import check_records
from sysid.diagnosis.replay.track import all_tracks
from sysid.drive import JointDrive, Nominal
from sysid.logs.log import make_log
from sysid.logs.read import write_log
from sysid.mechanism import model_mechanism

ARM = """
<mujoco><compiler angle="radian"/><worldbody>
<body><joint name="hip" axis="0 1 0" range="-1 1" limited="true"/>
<inertial pos="0 0 -0.1" mass="0.2" diaginertia="1e-3 1e-3 1e-3"/>
<body pos="0 0 -0.2"><joint name="knee" axis="0 1 0" range="-1 1" limited="true"/>
<inertial pos="0 0 -0.1" mass="0.2" diaginertia="1e-3 1e-3 1e-3"/></body>
</body></worldbody></mujoco>"""
DRIVE = """
schema: 1
joints: {"*": {kp: {value: 5.0}, kd: {value: 0.1}, effort: none}}
"""
T = np.arange(800) * 0.005


def arm(mjcf=ARM):
    model = mujoco.MjModel.from_xml_string(mjcf)
    drive = JointDrive(Nominal(5.0), Nominal(0.1), effort="none")
    return model_mechanism(model, {"*": drive})


def log_of(t_s=T, **columns):
    x = 0.5 * np.sin(2.0 * t_s)
    named = {"cmd.hip": x, "pos.hip": x, "cmd.knee": 0.0 * x, "pos.knee": 0.0 * x}
    named |= {name.replace("_", "."): values for name, values in columns.items()}
    return make_log(("hip", "knee"), t_s, named, source="arm.csv")


def refused(log, match, mechanism=None):
    with pytest.raises(InputError, match=match) as caught:
        diagnose([log], mechanism or arm())
    assert "\n" not in str(caught.value)


def driven(**drive):
    """The arm, with more said of its drives."""
    arms = arm()
    drives = {n: replace(d, **drive) for n, d in arms.drives.items()}
    return replace(arms, drives=drives)


def test_an_effort_in_another_column():
    gone = r"arm\.csv: cur\.hip: found no such column; valid: effort: none"
    refused(log_of(), gone, driven(effort="cur"))
    torque = log_of(tau_hip=0.0 * T)
    refused(torque, r"effort: tau or effort: none", driven(effort="cur"))


def test_a_torque_need_not_be_there_if_nothing_is_said():
    assert all_tracks([log_of()], driven(effort="tau"))


def test_a_setting_that_no_record_has():
    said = r"arm\.csv: settings: found none; valid: gain, the kp_setting"
    refused(log_of(), said, driven(kp_setting="gain"))


def test_degrees():
    x = 10.0 * np.sin(2.0 * T)
    refused(log_of(cmd_hip=x, pos_hip=x), r"arm\.csv: pos\.hip: found -10 to 10")


def test_degrees_of_a_joint_without_range():
    """What the guide says of them: only what no joint turns by is refused."""
    free = arm(ARM.replace('range="-1 1" limited="true"', ""))
    x = 12.5 * np.sin(2.0 * T)
    check_records([log_of(cmd_hip=x, pos_hip=x)], free)
    with pytest.raises(InputError, match=r"at most 12\.57 rad"):
        log_of(cmd_hip=1.01 * x, pos_hip=1.01 * x)


def test_milliseconds_of_rows_at_2_khz():
    """What the guide says of them: they may be seconds."""
    refused(log_of(0.51 * np.arange(8000.0)), r"t in milliseconds\?")
    check_records([log_of(0.5 * np.arange(8000.0))], arm())


def test_joints_in_another_order():
    x, y = 0.5 * np.sin(2.0 * T), 0.5 * np.sin(3.1 * T)
    good = {"cmd_hip": x, "pos_hip": x, "cmd_knee": y, "pos_knee": y}
    assert len(all_tracks([log_of(**good)], arm())) == 2
    refused(log_of(**good | {"pos_hip": y, "pos_knee": x}), r"follows cmd\.knee")


def test_without_readings():
    with pytest.raises(InputError, match=r"arm\.csv: pos\.hip: found no reading"):
        log_of(pos_hip=np.full(T.size, np.nan))
    few = np.where(np.arange(T.size) % 100 == 0, 0.1, np.nan)
    refused(log_of(pos_hip=few, pos_knee=few), r"arm\.csv")


def test_too_short():
    refused(log_of(T[:100]), r"1\.5 s")


def test_a_clock_that_jumps_all_the_time():
    t_s = T + np.floor(T / 0.5) * 10.0
    refused(log_of(t_s), r"1\.5 s of readings without a jump")


def test_half_of_the_readings_missing():
    rng = np.random.default_rng(5)
    x = np.where(rng.random(T.size) < 0.5, np.nan, 0.5 * np.sin(2.0 * T))
    found = diagnose([log_of(pos_hip=x)], arm())
    assert found.verdict in ("none", "not_observable", "unexplained")


def test_constant():
    found = diagnose([log_of(cmd_hip=0.0 * T, pos_hip=0.0 * T)], arm())
    assert found.verdict == "not_observable"
    assert found.next_experiment


def test_command_line(tmp_path, capsys):
    """Exit status 2 and one line for an empty file and for degrees."""
    (tmp_path / "arm.xml").write_text(ARM)
    (tmp_path / "drive.yaml").write_text(DRIVE)
    (tmp_path / "empty.csv").write_text("")
    x = 10.0 * np.sin(2.0 * T)
    write_log(log_of(cmd_hip=x, pos_hip=x), tmp_path / "degrees.csv")
    for name in ("empty.csv", "degrees.csv"):
        words = ["sysid", "diagnose", str(tmp_path / name), "-o", str(tmp_path / "o")]
        words += ["--mjcf", str(tmp_path / "arm.xml")]
        assert main([*words, "--drive", str(tmp_path / "drive.yaml")]) == 2
        printed = capsys.readouterr()
        assert printed.err.count("\n") == 1
        assert name in printed.err
        assert not (tmp_path / "o").exists()


def test_masses_that_are_no_share(tmp_path, capsys):
    """Exit status 2 and one line: per cent in the place of a share."""
    (tmp_path / "arm.xml").write_text(ARM)
    drive, log = tmp_path / "drive.yaml", tmp_path / "arm.csv"
    drive.write_text(DRIVE.replace("effort", "masses: {tolerance: 50}, effort"))
    write_log(log_of(), log)
    words = ["sysid", "diagnose", str(log), "-o", str(tmp_path / "o")]
    assert (
        main([*words, "--mjcf", str(tmp_path / "arm.xml"), "--drive", str(drive)]) == 2
    )
    printed = capsys.readouterr()
    assert printed.err.count("\n") == 1
    said = "drive.yaml: joints.*.masses.tolerance: found 50.0; valid: a finite number"
    assert f"{said} >= 0 <= 10" in printed.err


def test_milliseconds():
    log = log_of()
    slow = make_log(log.header.joints, 1e3 * T, log.columns, source="arm.csv")
    refused(slow, r"arm\.csv: t: found rows 5 s apart; valid: at most 0\.5 s")
