import numpy as np
from support.synthetic_sweep import study, write_sweep

from fingers_mjx.studies.comparison.comparison import compared
from fingers_mjx.studies.comparison.curves import read_curves
from fingers_mjx.studies.comparison.figures import (
    difference_dots,
    learning_curves,
    seed_dots,
)
from fingers_mjx.studies.comparison.page import write_page
from fingers_mjx.studies.comparison.results import read_results
from fingers_mjx.studies.sweep.manifest import read_manifest


def made(path):
    manifest = read_manifest(path)
    return compared(read_results(path, manifest), "base"), read_curves(path, manifest)


def test_the_page_says_all_and_loads_nothing(tmp_path):
    states = {("lift", 1): ("failed", "out of <memory>")}
    path = write_sweep(tmp_path / "s", study({"lift": [0.02, 0.0, 0.01]}, 3), states)
    text = write_page(
        tmp_path / "c.html", *made(path), ["fingers compare s"]
    ).read_text()
    assert text.count("data:image/png;base64,") == 3
    assert "http" not in text and "<script" not in text and 'src="/' not in text
    words = ("comparisons read together", "out of &lt;memory&gt;", "lift/1", "Holm",
             "task_speed_mps\N{NO-BREAK SPACE}↑", "interquartile mean",
             "fingers compare s")  # fmt: skip
    assert [word for word in words if word not in text] == []


def test_a_sweep_without_curves_or_seeds_has_a_page(tmp_path):
    """Of every arm nothing is left, or one seed."""
    values = study({"lift": 0.02, "none": 0.0}, 1)
    states = {("none", 0): ("diverged", "")}
    path = write_sweep(tmp_path / "s", values, states, curves=False)
    text = write_page(tmp_path / "c.html", *made(path), []).read_text()
    assert "One seed per arm proves nothing" in text
    assert "No seed is in both arms" in text
    assert "No member has a learning curve" in text


def test_figures_show_every_seed_and_mean(tmp_path):
    comparison, curves = made(write_sweep(tmp_path / "s", study({"lift": 0.02}, 4)))
    dots = [ax for ax in seed_dots(comparison).axes if ax.get_visible()]
    assert [ax.get_xlabel() for ax in dots] == list(comparison.measures)
    speed = dots[list(comparison.measures).index("task_speed_mps")].lines
    drawn = np.concatenate([line.get_xdata() for line in speed])
    for name in ("base", "lift"):
        cell = comparison.cell(name, "task_speed_mps")
        assert set(cell.values.values()) | {cell.arm.mean} <= set(drawn)
    (gain,) = [
        ax.lines[1].get_xdata()
        for ax in difference_dots(comparison).axes
        if ax.get_xlabel() == "task_speed_mps"
    ]
    np.testing.assert_allclose(gain, 0.02)
    panel = learning_curves(curves, comparison).axes[0]
    assert len(panel.collections) == 2  # a band of each configuration
    assert len([line for line in panel.lines if len(line.get_xdata())]) == 2 * (4 + 1)
