"""One picture from two renderers."""

import os
import sys
import types

import mujoco
import numpy as np
import pytest
from support.cli_setup import default_hand

from envs.errors import InputError
from envs.hand.model import build_model
from envs.hand.stance import stance_of
from fingers_mjx.pictures import renderer as module
from fingers_mjx.pictures.camera import Camera
from fingers_mjx.pictures.opengl import PLATFORMS, OpenGlRenderer
from fingers_mjx.pictures.raycast import render
from fingers_mjx.pictures.renderer import renderer
from fingers_mjx.pictures.shade import Look

SIZE = (160, 120)


@pytest.fixture(scope="module")
def scene():
    stance = stance_of(default_hand())
    model = build_model(default_hand(), np.array(stance.q_off))
    data = mujoco.MjData(model)
    data.qpos[: len(stance.qpos)] = stance.qpos
    mujoco.mj_forward(model, data)
    return model, data


@pytest.fixture
def opengl(scene):
    try:
        found = OpenGlRenderer(scene[0], SIZE, Look())
    except InputError as error:
        pytest.skip(str(error))
    yield found
    found.close()


def difference(a, b):
    """Share of pixels that a person would see differ, and the mean difference."""
    apart = np.abs(a.astype(int) - b.astype(int)).max(axis=2)
    return float((apart > 40).mean()), float(apart.mean())


@pytest.mark.parametrize("camera", [Camera(), Camera(azimuth_deg=250.0)])
def test_both_draw_the_same_picture(scene, opengl, camera):
    model, data = scene
    cast, drawn = render(model, data, camera, SIZE), opengl.draw(data, camera)
    share, mean = difference(cast, drawn)
    assert share < 0.02
    assert mean < 4.0


def test_a_hand_that_has_moved_is_another_picture(scene, opengl):
    model, data = scene
    moved = mujoco.MjData(model)
    moved.qpos[:] = data.qpos
    moved.qpos[0] += 0.03
    mujoco.mj_forward(model, moved)
    cast = render(model, data, Camera(), SIZE)
    share, _ = difference(cast, opengl.draw(moved, Camera()))
    assert share > 0.05


def test_a_context_in_which_nothing_can_be_drawn_is_no_opengl(scene, monkeypatch):
    """GLFW without a display gives one; drawing in it ends in a FatalError."""

    class Empty:
        def __init__(self, *_):
            tried.append(os.environ["PYOPENGL_PLATFORM"])

        def make_current(self):
            pass

        def free(self):
            freed.append(self)

    tried: list[str] = []
    freed: list[Empty] = []
    for name in PLATFORMS:
        made = types.SimpleNamespace(GLContext=Empty)
        monkeypatch.setitem(sys.modules, f"mujoco.{name}", made)
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    monkeypatch.setenv("PYOPENGL_PLATFORM", "before")
    with pytest.raises(InputError, match=r"--renderer.*no OpenGL \(egl: "):
        OpenGlRenderer(scene[0], SIZE, Look())
    assert tried == ["egl", "osmesa", ""] and len(freed) == 3
    assert os.environ["PYOPENGL_PLATFORM"] == "before"
    assert module.drawn_by() == "ray casting on the CPU"


def test_without_opengl_rays_are_cast(scene, monkeypatch):
    def none_here(*_):
        raise InputError("--renderer", "mujoco", "no OpenGL", "raycast")

    monkeypatch.setattr(module, "OpenGlRenderer", none_here)
    model, data = scene
    with renderer("auto", model, SIZE) as draw:
        drawn = draw(data, Camera())
    np.testing.assert_array_equal(drawn, render(model, data, Camera(), SIZE))
    with (
        pytest.raises(InputError, match=r"--renderer.*no OpenGL"),
        renderer("mujoco", model, SIZE),
    ):
        pass


def test_what_draws_is_named(monkeypatch):
    def none_here(*_):
        raise InputError("--renderer", "mujoco", "no OpenGL", "raycast")

    class OnGpu:
        hardware = True

        def __init__(self, *_):
            pass

        def close(self):
            closed.append(self)

    closed = []
    monkeypatch.setattr(module, "OpenGlRenderer", none_here)
    assert module.drawn_by() == "ray casting on the CPU"
    monkeypatch.setattr(module, "OpenGlRenderer", OnGpu)
    monkeypatch.setattr(module, "renderer_name", lambda: "NVIDIA H200/PCIe")
    assert module.drawn_by() == "OpenGL on NVIDIA H200/PCIe"
    monkeypatch.setattr(OnGpu, "hardware", False)
    assert module.drawn_by() == "ray casting on the CPU"
    assert len(closed) == 2


def test_an_unknown_renderer_is_refused(scene):
    with (
        pytest.raises(InputError, match="auto, mujoco, raycast"),
        renderer("opengl", scene[0], SIZE),
    ):
        pass
