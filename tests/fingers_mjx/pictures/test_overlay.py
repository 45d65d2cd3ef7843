import numpy as np

from fingers_mjx.pictures.camera import Camera, position, project
from fingers_mjx.pictures.overlay import (
    Area,
    Dots,
    Label,
    Line,
    caption,
    draw,
    frame_axes,
)

CAMERA = Camera((0, 0, 0), 1.0, 90.0, -90.0, fovy_deg=60.0)
PAPER = np.full((120, 160, 3), 255, np.uint8)


def changed(image):
    return (image != PAPER).any(axis=2)


def test_dots_lie_where_the_points_project():
    points = np.array([[0.1, 0.2, 0.0], [-0.3, 0.1, 0.0]])
    image = draw(PAPER, CAMERA, [Dots(points, (255, 0, 0), radius_px=3)])
    for u, v in project(CAMERA, (160, 120), points)[0]:
        np.testing.assert_array_equal(image[int(v), int(u)], [255, 0, 0])
    ink = np.sum(255 - image[..., 1].astype(float)) / 255
    np.testing.assert_allclose(ink, 2 * np.pi * 3**2, rtol=0.15)


def test_a_line_breaks_where_it_passes_behind_the_camera():
    up = position(CAMERA) + np.array([0, 0, 0.5])
    points = np.array([[-0.3, 0, 0], [-0.1, 0, 0], up, [0.1, 0, 0], [0.3, 0, 0]])
    image = draw(PAPER, CAMERA, [Line(points, (0, 0, 0))])
    columns = np.flatnonzero(changed(image).any(axis=0))
    drawn = project(CAMERA, (160, 120), points[[0, 1, 3, 4]])[0][:, 0]
    assert columns.min() >= drawn.min() - 3
    assert columns.max() <= drawn.max() + 3
    middle = (drawn[1] + 4 < columns) & (columns < drawn[2] - 4)
    assert not middle.any()


def test_an_area_tints_and_keeps_what_is_below():
    square = 0.2 * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    image = draw(PAPER, CAMERA, [Area(square, (0, 0, 0), opacity=0.25)])
    assert abs(int(image[60, 80, 0]) - 191) <= 2
    np.testing.assert_array_equal(image[2, 2], PAPER[2, 2])


def test_nothing_changes_without_items_or_behind_the_camera():
    behind = position(CAMERA) + np.array([[0, 0, 0.2], [0.1, 0, 0.3], [0, 0.1, 0.4]])
    items = [Line(behind), Dots(behind), Area(behind), Label(behind[0], "x")]
    np.testing.assert_array_equal(draw(PAPER, CAMERA, items), PAPER)
    np.testing.assert_array_equal(draw(PAPER, CAMERA, []), PAPER)


def test_axes_run_along_the_columns_of_the_rotation():
    rotation = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]])
    lines = [i for i in frame_axes(np.ones(3), rotation, 0.5) if isinstance(i, Line)]
    ends = np.stack([line.points_w[1] - line.points_w[0] for line in lines])
    np.testing.assert_allclose(ends, 0.5 * rotation.T)


def test_a_caption_leaves_the_given_picture_alone():
    image = caption(PAPER, "0.16 m/s")
    assert changed(image)[:30].any()
    assert not changed(image)[60:].any()
    assert (PAPER == 255).all()
