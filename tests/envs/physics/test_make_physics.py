import logging
import os
import subprocess
import sys

import jax
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


LOG = logging.getLogger("jax._src.xla_bridge")


def raising(words, log=""):
    """Pretends a JAX whose plugin for CUDA fails: it says so, or logs it before."""

    def devices(kind):
        try:
            if log:
                raise ValueError(log)
        except ValueError:
            LOG.exception("Jax plugin configuration error")
        raise RuntimeError(words)

    return devices


@pytest.mark.parametrize(
    ("devices", "fault"),
    [
        (lambda kind: ["a GPU"], None),
        (lambda kind: [], "no device"),
        (raising("Unable to initialize\n backend"), "Unable to initialize backend"),
        (raising("Unknown backend", log="no libcuda"), "no libcuda"),
    ],
)
def test_why_cuda_is_not_there_is_what_jax_says(monkeypatch, devices, fault):
    monkeypatch.setattr(backends, "WARP_INSTALLED", True)
    monkeypatch.setattr(jax, "devices", devices)
    monkeypatch.setattr(LOG, "propagate", True)
    faults = []
    assert default_backend(faults.append) == ("cpu" if fault else "warp")
    assert faults == ([fault] if fault else [])
    assert backends.cuda_fault() == fault


BROKEN = """
import jax._src.xla_bridge as bridge
bridge.hardware_utils.has_visible_nvidia_gpu = lambda: True
def fail():
    raise RuntimeError("no driver")
def initialize():
    {initialize}
"""
ON_FIRST_USE = 'bridge.register_backend_factory("cuda", fail, fail_quietly=False)'


@pytest.mark.parametrize("initialize", ["fail()", ON_FIRST_USE])
def test_jax_says_why_a_plugin_does_not_start(tmp_path, initialize):
    """A JAX of its own, with a plugin that is installed and fails."""
    place = tmp_path / "jax_plugins/xla_cuda12/__init__.py"
    place.parent.mkdir(parents=True)
    place.write_text(BROKEN.format(initialize=initialize), "utf-8")
    program = "from envs.physics.backends import cuda_fault as f; print(f())"
    path = os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])
    run = subprocess.run(
        [sys.executable, "-c", program],
        env={**os.environ, "PYTHONPATH": path, "JAX_PLATFORMS": ""},
        capture_output=True,
        text=True,
        check=True,
    )
    assert "no driver" in run.stdout


def test_import_prints_nothing():
    run = subprocess.run(
        [sys.executable, "-c", "import envs.physics.backends"],
        capture_output=True,
        check=True,
    )
    assert run.stdout == b""
