import numpy as np
import pytest
from support.sysid_logs import small_log

from envs.errors import InputError
from fingers_mjx.cli.main import main
from sysid.logs.info import info_lines
from sysid.logs.log import make_log
from sysid.logs.read import write_log


def test_info_reports_what_is_irregular():
    lines = info_lines(small_log(note="second record"))
    text = "\n".join(lines)
    assert "joints    knee, hip" in text
    assert "load 0.49 kg at 0.1 m" in text
    assert "settings  kp 200" in text
    assert "second record" in text
    (effort,) = [line for line in lines if line.startswith("tau.knee")]
    assert "N·m; " in effort
    assert effort.endswith("3 missing; 2 gaps")
    (angle,) = [line for line in lines if line.startswith("pos.hip")]
    assert angle.endswith("1 gaps")


def test_a_clock_that_stands_is_reported():
    same, angle = np.ones(2), np.array([0.0, 1.0])
    log = make_log(("a",), same, {"cmd.a": angle, "pos.a": angle})
    with pytest.raises(InputError, match="times that increase"):
        info_lines(log)


def test_the_command(tmp_path, capsys):
    write_log(small_log(), tmp_path / "x.parquet")
    assert main(["sysid", "info", str(tmp_path / "x.parquet")]) == 0
    assert "pos.knee" in capsys.readouterr().out
    assert main(["sysid", "info", str(tmp_path / "none.csv")]) == 2
    message = capsys.readouterr().err
    assert "no such file" in message
    assert message.count("\n") == 1
