import subprocess
import sys

import mujoco
import pytest

from envs.errors import InputError
from envs.physics import backends, quiet_mjx
from envs.physics.backends import default_backend, make_physics


def test_unknown_backend_is_named_with_the_nearest(mj_model):
    with pytest.raises(InputError, match=r"backend: found wrap; .*mean warp\?"):
        make_physics("wrap", mj_model, 4, 1)


@pytest.mark.parametrize("backend", ["cpu", "jax"])
def test_state_beyond_the_carried_is_refused(backend):
    model = mujoco.MjModel.from_xml_string(
        "<mujoco><worldbody><body><joint name='j'/><geom size='1'/></body></worldbody>"
        "<actuator><intvelocity joint='j' actrange='-1 1'/></actuator></mujoco>"
    )
    with pytest.raises(InputError, match="model: na: found 1"):
        make_physics(backend, model, 4, 1)
    with pytest.raises(InputError, match="n_substeps: found 0"):
        make_physics(backend, model, 0, 1)


def test_feature_that_mjx_lacks_is_named():
    model = mujoco.MjModel.from_xml_string(
        "<mujoco><worldbody><geom name='g' size='1'/></worldbody>"
        "<sensor><contact geom1='g' data='force' reduce='netforce'/></sensor></mujoco>"
    )
    with pytest.raises(InputError, match="netforce"):
        make_physics("jax", model, 4, 1)


def test_missing_warp_is_reported_and_not_the_default(mj_model, monkeypatch):
    monkeypatch.setattr(quiet_mjx, "WARP_INSTALLED", False)
    monkeypatch.setattr(backends, "WARP_INSTALLED", False)
    with pytest.raises(InputError, match="extra cuda12"):
        make_physics("warp", mj_model, 4, 1)
    assert default_backend() == "cpu"


def test_import_prints_nothing():
    run = subprocess.run(
        [sys.executable, "-c", "import envs.physics.backends"],
        capture_output=True,
        check=True,
    )
    assert run.stdout == b""
