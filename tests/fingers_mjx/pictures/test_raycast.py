import mujoco
import numpy as np
import pytest

from fingers_mjx.pictures.camera import Camera, pixel_centres, position, project, rays
from fingers_mjx.pictures.raycast import (
    cast,
    exact,
    geom_colours,
    lamps,
    render,
    seen_from,
)
from fingers_mjx.pictures.shade import Look, checkerboard

SEED = 7
HAND = """<mujoco><asset><material name="teal" rgba="0 .5 .5 1"/></asset><worldbody>
<geom name="floor" type="plane" size="0 0 1"/>
<body name="palm" pos="0 0 .08" quat=".97 .1 .2 0"><freejoint/>
 <inertial pos=".05 .04 .06" mass=".5" diaginertia="1e-3 1e-3 1e-3"/>
 <geom type="box" size=".05 .04 .015" rgba=".8 .1 .1 1"/>
 {fingers}
</body></worldbody></mujoco>"""
FINGER = """<geom type="capsule" fromto="{x} {y} 0 {x2} {y} -.07" size=".008"
 material="teal"/>"""
BALL = """<mujoco><worldbody><geom type="plane" size="0 0 1"/>
<geom type="sphere" size=".1" pos="0 0 .5" rgba="1 0 0 1"/></worldbody></mujoco>"""
SIZE = (96, 72)


def load(xml):
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


@pytest.fixture(scope="module")
def hand():
    places = [(-0.03, 0.03), (0.05, -0.03), (0.05, -0.01), (0.05, 0.01), (0.05, 0.03)]
    fingers = [FINGER.format(x=x, y=y, x2=1.4 * x) for x, y in places]
    return load(HAND.format(fingers="".join(fingers)))


def one_by_one(model, data, origin, directions):
    geom, groups = np.zeros(1, np.int32), np.array([1, 1, 1, 0, 0, 0], np.uint8)
    found = []
    for ray in directions:
        distance = mujoco.mj_ray(model, data, origin, ray, groups, True, -1, geom)
        found.append((geom[0], distance))
    return np.array(found).T


@pytest.mark.parametrize("azimuth", [0.0, 77.0, 200.0, 301.0])
def test_cast_meets_what_single_rays_meet(hand, azimuth):
    model, data = hand
    camera = Camera(azimuth_deg=azimuth, distance_m=0.3)
    directions = rays(camera, SIZE, pixel_centres(SIZE))
    geom, distance = one_by_one(model, data, position(camera), directions)
    hits = cast(exact(model), data, position(camera), directions)
    np.testing.assert_array_equal(hits.geom, geom)
    np.testing.assert_allclose(hits.distance_m, distance, atol=1e-9)
    control = cast(model, data, position(camera), directions)
    assert (control.geom != geom).any(), "MuJoCo culls right again: drop exact()"


def test_project_inverts_rays():
    print("seed", SEED)
    rng = np.random.default_rng(SEED)
    camera = Camera((0.1, -0.2, 0.3), 0.7, 33.0, -41.0, 50.0)
    points_px = rng.uniform([0, 0], SIZE, (50, 2))
    far = rng.uniform(0.2, 2.0, (50, 1))
    points_w = position(camera) + far * rays(camera, SIZE, points_px)
    pixels, depth = project(camera, SIZE, points_w)
    np.testing.assert_allclose(pixels, points_px, atol=1e-9)
    assert np.all(depth > 0)
    mirrored = position(camera) - far * rays(camera, SIZE, points_px)
    assert np.isnan(project(camera, SIZE, mirrored)[0]).all()


def test_camera_looks_as_in_the_mujoco_viewer():
    camera = Camera((1.0, 2.0, 3.0), 2.0, azimuth_deg=90.0, elevation_deg=0.0)
    np.testing.assert_allclose(position(camera), [1.0, 0.0, 3.0], atol=1e-12)
    right_up = np.array([[1.1, 2.0, 3.1]])
    pixels, _ = project(camera, SIZE, right_up)
    assert pixels[0, 0] > SIZE[0] / 2
    assert pixels[0, 1] < SIZE[1] / 2


def test_a_ball_covers_its_solid_angle():
    model, data = load(BALL)
    camera = Camera((0, 0, 0.5), 1.0, 20.0, 0.0, fovy_deg=30.0)
    directions = rays(camera, SIZE, pixel_centres(SIZE))
    hits = cast(exact(model), data, position(camera), directions)
    away = np.degrees(np.arccos(directions @ -position_of_ball(camera)))
    inside = away < np.degrees(np.arcsin(0.1 / 1.0))
    np.testing.assert_array_equal(hits.geom == 1, inside)
    points = position(camera) + hits.distance_m[:, None] * directions
    outward = (points[inside] - [0, 0, 0.5]) / 0.1
    np.testing.assert_allclose(hits.normal_w[inside], outward, atol=1e-9)


def position_of_ball(camera):
    offset = position(camera) - [0, 0, 0.5]
    return offset / np.linalg.norm(offset)


def test_shadow_falls_opposite_to_the_light():
    model, data = load(BALL)
    light = np.array([2.0, 0.0, 2.5])  # its ray through the ball lands at x = -0.5
    points = np.array([[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0], [-0.5, 0.5, 0.0]])
    np.testing.assert_array_equal(seen_from(model, data, light, points), [0, 1, 1])
    other = light * [-1, 1, 1]
    np.testing.assert_array_equal(seen_from(model, data, other, points), [1, 0, 1])


def test_floor_reflects_as_lambert_says_in_light_and_in_shadow():
    model, data = load(BALL)
    camera = Camera((0, 0, 0), 1.5, 90.0, -35.0)
    grey = ((0.7,) * 3,) * 2
    look = Look(light_w=(2.0, 0.0, 2.0), tiles=grey, fade_m=1e6)
    image = render(model, data, camera, (160, 120), look, samples=1)
    pixels, _ = project(camera, (160, 120), np.array([[-0.5, 0, 0], [0.5, 0, 0]]))
    shadow, control = (image[int(v), int(u)] for u, v in pixels)
    dark = 0.7**2.2 * look.ambient
    bright = dark + 0.7**2.2 * look.key * np.cos(np.radians(45))
    np.testing.assert_allclose(shadow, 255 * dark ** (1 / 2.2), atol=1)
    np.testing.assert_allclose(control, 255 * bright ** (1 / 2.2), atol=1)


def test_floor_is_a_checkerboard_of_the_world():
    look = Look(tile_m=0.1)
    points = np.array([[0.05, 0.05, 0], [0.15, 0.05, 0], [0.15, 0.15, 0]])
    points = np.concatenate([points, points - [0.2, 0, 0]])
    colours = checkerboard(look, points)
    np.testing.assert_array_equal(colours[0], colours[2])
    assert (colours[0] != colours[1]).all()
    np.testing.assert_array_equal(colours[:3], colours[3:])


def test_colour_is_the_geoms_own_or_its_materials(hand):
    colours = geom_colours(hand[0])
    np.testing.assert_allclose(colours[1], [0.8, 0.1, 0.1], atol=1e-6)
    np.testing.assert_allclose(colours[2], [0, 0.5, 0.5], atol=1e-6)


def test_what_is_transparent_or_of_a_hidden_group_is_not_drawn():
    model, data = load(BALL)
    camera = Camera((0, 0, 0.5), 1.0, 0.0, 0.0)
    seen = render(model, data, camera, SIZE)[36, 48]
    assert seen[0] > 2 * seen[1]
    model.geom_group[1] = 3
    hidden = render(model, data, camera, SIZE)[36, 48]
    assert hidden[0] < 1.2 * hidden[1]
    shown = render(model, data, camera, SIZE, Look(groups=(0, 3)))[36, 48]
    np.testing.assert_array_equal(shown, seen)
    model.geom_rgba[1, 3] = 0
    air = render(model, data, camera, SIZE, Look(groups=(0, 3)))[36, 48]
    np.testing.assert_array_equal(air, hidden)


def test_a_scene_without_anything_is_sky():
    model, data = load("<mujoco><worldbody/></mujoco>")
    image = render(model, data, Camera(elevation_deg=20.0), SIZE)
    assert image.shape == (72, 96, 3)
    assert (image[0, :, 2] > image[0, :, 0]).all()  # blue overhead


def test_supersampling_is_nearer_to_the_truth(hand):
    model, data = hand
    camera = Camera(distance_m=0.4)
    fine = render(model, data, camera, (8 * SIZE[0], 8 * SIZE[1]), samples=1)
    truth = fine.reshape(SIZE[1], 8, SIZE[0], 8, 3).mean(axis=(1, 3))
    errors = [
        np.abs(render(model, data, camera, SIZE, samples=s) - truth).mean()
        for s in (1, 2, 4)
    ]
    assert errors[0] > 1.5 * errors[1]
    assert errors[1] > errors[2]


def test_the_same_scene_gives_the_same_picture(hand):
    model, data = hand
    look = Look(light_samples=3, sky_samples=3)
    first = render(model, data, Camera(), SIZE, look)
    np.testing.assert_array_equal(first, render(model, data, Camera(), SIZE, look))
    assert (model.body_bvhadr >= 0).any(), "the caller's model was changed"


def test_lamps_surround_the_light():
    look = Look(light_w=(0, 0, 5), light_size=0.1, light_samples=64, sky_samples=64)
    key, dome = lamps(look)
    np.testing.assert_allclose(key.mean(axis=0), [0, 0, 1], atol=0.01)
    angle = np.degrees(np.arccos(key[:, 2])).max()
    assert 5.0 < angle <= np.degrees(np.arctan(0.1))
    assert np.all(dome[:, 2] > 0)
    np.testing.assert_allclose(lamps(Look(light_w=(0, 0, 5)))[0], [[0, 0, 1]])
