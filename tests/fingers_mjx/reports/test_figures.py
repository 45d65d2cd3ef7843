import io

import numpy as np
import pytest
from matplotlib.colors import to_rgb

from fingers_mjx.reports.figures import (
    FINGER_COLOURS,
    foot_trajectories,
    gait_diagram,
    standing,
    tracking,
    tracking_in_time,
    training_curves,
)

DT = 0.02
TIME = np.arange(200) * DT
CONTACT = np.stack([np.sin(6 * TIME + tip) > 0 for tip in range(5)], axis=1)
PATHS = np.random.default_rng(0).normal(0, 0.01, (200, 5, 3))
COLUMNS = {
    name: np.linspace(0, 0.2, 9)
    for name in (
        "command_speed_mps",
        "task_speed_mps",
        "command_turn_rate_rad_s",
        "turn_rate_rad_s",
    )
}
ROWS = [{"steps": 10 * i, "return": float(i)} for i in range(5)]


def all_figures():
    return {
        "gait": gait_diagram(CONTACT, DT),
        "feet": foot_trajectories(PATHS, CONTACT),
        "tracking": tracking(COLUMNS),
        "time": tracking_in_time(PATHS[:, 0], PATHS[:, 1, :2], PATHS[:, 2, 0], DT),
        "standing": standing({"a": CONTACT}, DT),
        "training": training_curves({"a": ROWS}, {"return": "return [1]"}),
    }


@pytest.mark.parametrize("name", all_figures())
def test_figures_draw_and_label_their_axes_with_units(name):
    figure = all_figures()[name]
    image = io.BytesIO()
    figure.savefig(image, format="png")
    assert image.getvalue().startswith(b"\x89PNG")
    labels = [text for axes in figure.axes for text in labels_of(axes)]
    assert labels
    bare = {"environment steps"}  # counts have no unit
    assert all("[" in label for label in labels if label not in bare), labels


def labels_of(axes):
    return [text for text in (axes.get_xlabel(), axes.get_ylabel()) if text]


def test_bars_of_the_gait_diagram_are_the_contacts():
    contact = np.zeros((100, 5), bool)
    contact[10:30, 1] = contact[50:100, 1] = True
    (axes,) = gait_diagram(contact, DT).axes
    index = axes.collections[1]
    spans = [p.get_extents().intervalx for p in index.get_paths()]
    np.testing.assert_allclose(spans, [[0.2, 0.6], [1.0, 2.0]])
    assert not axes.collections[0].get_paths()
    assert to_rgb(FINGER_COLOURS[1]) == tuple(index.get_facecolor()[0][:3])


def test_fingers_keep_their_colours_and_stance_is_strong():
    side, top = foot_trajectories(PATHS, CONTACT).axes
    for axes in (side, top):
        assert [line.get_color() for line in axes.lines[1::2]] == list(FINGER_COLOURS)
    stance = side.lines[1].get_ydata()
    np.testing.assert_array_equal(np.isfinite(stance), CONTACT[:, 0])
    np.testing.assert_allclose(side.lines[0].get_ydata(), 1000 * PATHS[:, 0, 2])
    np.testing.assert_allclose(top.lines[0].get_ydata(), 1000 * PATHS[:, 0, 1])


def test_curves_skip_rows_without_the_metric_and_keep_runs_apart():
    mixed = [*ROWS, {"steps": 50}, {"steps": 60, "return": 9.0}]
    figure = training_curves({"ours": mixed, "stock": ROWS[:2]}, {"return": "return"})
    ours, stock = figure.axes[0].lines
    np.testing.assert_array_equal(ours.get_xdata(), [0, 10, 20, 30, 40, 60])
    np.testing.assert_array_equal(stock.get_ydata(), [0, 1])
    assert ours.get_color() != stock.get_color()
    empty = training_curves({"none": []}, {"return": "return"})
    assert len(empty.axes[0].lines[0].get_xdata()) == 0


def test_figures_of_nothing_are_empty_not_broken():
    gait_diagram(CONTACT[:0], DT).savefig(io.BytesIO())
    tracking({name: np.full(3, np.nan) for name in COLUMNS}).savefig(io.BytesIO())


def test_a_hand_that_has_fallen_does_not_stand_up_again():
    failed = np.zeros((10, 4), bool)
    failed[3, 0] = failed[6:, 1] = True
    line = standing({"policy": failed}, DT).axes[0].lines[0]
    np.testing.assert_allclose(line.get_ydata(), [100] * 3 + [75] * 3 + [50] * 4)
    np.testing.assert_allclose(line.get_xdata(), DT * np.arange(1, 11))
