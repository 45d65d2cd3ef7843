import pytest

from envs.physics.quiet_mujoco import mujoco

XML = (
    "<mujoco><worldbody><body><freejoint/><geom size='1'/></body></worldbody></mujoco>"
)


def diverge():
    model = mujoco.MjModel.from_xml_string(XML)
    data = mujoco.MjData(model)
    data.qvel[0] = float("nan")
    mujoco.mj_step(model, data)
    assert data.warning[mujoco.mjtWarning.mjWARN_BADQVEL].number == 1


@pytest.fixture
def default_log():
    """MuJoCo as it is by default."""
    config = mujoco.MjLogConfig.get()
    config.logto_console = config.logto_file = True
    config.set()
    yield
    config.logto_console = config.logto_file = False
    config.set()


def test_a_diverged_world_leaves_no_file_and_prints_nothing(
    tmp_path, monkeypatch, capfd
):
    monkeypatch.chdir(tmp_path)
    diverge()
    assert list(tmp_path.iterdir()) == []
    assert capfd.readouterr() == ("", "")


def test_by_default_it_would(tmp_path, monkeypatch, capfd, default_log):
    """Negative control."""
    monkeypatch.chdir(tmp_path)
    diverge()
    assert [path.name for path in tmp_path.iterdir()] == ["MUJOCO_LOG.TXT"]
    assert "unstable" in "".join(capfd.readouterr())
