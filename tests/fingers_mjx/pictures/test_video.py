import imageio_ffmpeg
import mujoco
import numpy as np
import pytest
from PIL import Image

from envs.errors import InputError
from fingers_mjx.pictures.camera import Camera
from fingers_mjx.pictures.video import follow, frames, write_animation, write_mp4

BOX = """<mujoco><worldbody><geom type="plane" size="0 0 1"/><body pos="0 0 .1">
<freejoint/><geom type="box" size=".05 .03 .02" rgba=".8 .2 .1 1"/></body>
</worldbody></mujoco>"""
FPS = 25.0


def pictures(count=20, size=(64, 48)):
    for index in range(count):
        picture = np.full((size[1], size[0], 3), 230, np.uint8)
        picture[10:30, 2 * index : 2 * index + 12] = (200, 30, 30)
        yield picture


def read_mp4(path):
    reader = imageio_ffmpeg.read_frames(str(path))
    about = next(reader)
    width, height = about["size"]
    found = [np.frombuffer(f, np.uint8).reshape(height, width, 3) for f in reader]
    return about, np.stack(found)


def test_mp4_plays_back_what_was_written(tmp_path):
    about, found = read_mp4(write_mp4(tmp_path / "a.mp4", pictures(), FPS))
    assert about["fps"] == FPS
    assert about["codec"] == "h264"
    difference = np.abs(found.astype(float) - np.stack(list(pictures())))
    assert difference.mean() < 4.0
    assert list(tmp_path.iterdir()) == [tmp_path / "a.mp4"]


def test_odd_edges_lose_a_line(tmp_path):
    about, _ = read_mp4(write_mp4(tmp_path / "a.mp4", pictures(3, (65, 49)), FPS))
    assert about["size"] == (64, 48)


def test_a_failing_source_leaves_the_old_video(tmp_path):
    def failing():
        yield from pictures(3)
        raise RuntimeError("the simulation stopped")

    path = tmp_path / "a.mp4"
    path.write_bytes(b"old")
    with pytest.raises(RuntimeError, match="simulation stopped"):
        write_mp4(path, failing(), FPS)
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("suffix", [".webp", ".gif"])
def test_animation_keeps_frames_time_and_colours(tmp_path, suffix):
    path = write_animation(tmp_path / f"a{suffix}", pictures(), FPS)
    with Image.open(path) as animation:
        assert animation.n_frames == 20
        assert animation.info["loop"] == 0
        animation.seek(7)
        animation.load()
        assert abs(animation.info["duration"] - 40) <= 1
        found = np.asarray(animation.convert("RGB")).astype(float)
    assert np.abs(found - list(pictures())[7]).mean() < 8.0


@pytest.mark.parametrize("suffix", [".webp", ".gif"])
def test_animation_is_made_to_fit(tmp_path, suffix):
    rng = np.random.default_rng(3)
    noise = [rng.integers(0, 255, (48, 64, 3), np.uint8) for _ in range(6)]
    large = write_animation(tmp_path / f"a{suffix}", noise, FPS).stat().st_size
    bound = int(0.7 * large)
    path = write_animation(tmp_path / f"b{suffix}", noise, FPS, bound)
    assert path.stat().st_size <= bound
    with pytest.raises(InputError, match="at most 100 bytes"):
        write_animation(tmp_path / f"c{suffix}", noise, FPS, 100)


def test_bad_requests_name_the_file(tmp_path):
    with pytest.raises(InputError, match=r"a\.avi.*one of \.webp, \.gif"):
        write_animation(tmp_path / "a.avi", pictures(), FPS)
    with pytest.raises(InputError, match="no frames"):
        write_mp4(tmp_path / "a.mp4", [], FPS)
    with pytest.raises(InputError, match="no frames"):
        write_animation(tmp_path / "a.gif", [], FPS)
    assert not list(tmp_path.iterdir())


def test_camera_follows_steady_motion_without_lag_and_ignores_shaking():
    time = np.arange(200) / FPS
    steady = np.stack([0.1 * time, -0.05 * time, 0.1 + 0.01 * np.sin(time)], axis=1)
    shaking = steady + 0.02 * np.sin(2 * np.pi * 3.0 * time)[:, None]
    lookat = np.array([c.lookat_w for c in follow(Camera(), shaking, FPS)])
    inside = slice(50, -50)
    np.testing.assert_allclose(lookat[inside, :2], steady[inside, :2], atol=2e-4)
    assert np.ptp(lookat[:, 2]) == 0


def test_frames_show_the_recorded_poses():
    model = mujoco.MjModel.from_xml_string(BOX)
    qpos = np.tile(model.qpos0, (3, 1))
    qpos[:, 0] = [0.0, 0.1, 0.2]
    still = [Camera(azimuth_deg=90.0)] * 3
    shown = [f.astype(int) for f in frames(model, qpos, still, (80, 60))]
    red = [np.argwhere(f[..., 0] > 1.5 * f[..., 2])[:, 1].mean() for f in shown]
    assert red[0] < red[1] < red[2]
    moving = follow(still[0], qpos[:, :3], FPS, smooth_s=0.001)
    followed = list(frames(model, qpos, moving, (80, 60)))
    centre = [np.argwhere(f[..., 0] > 1.5 * f[..., 2])[:, 1].mean() for f in followed]
    assert np.ptp(centre) < 1.5
