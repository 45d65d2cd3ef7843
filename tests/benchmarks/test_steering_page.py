"""The page about steering says what was measured."""

from benchmarks.claims.steering_page import PAGE, TAKEN, draw, page, read


def test_the_page_is_what_the_results_say(tmp_path):
    measured = read()
    assert PAGE.read_text("utf-8") == page(measured)
    measured[TAKEN]["headings"][0]["error_deg"]["mean"] += 1.0
    assert PAGE.read_text("utf-8") != page(measured)


def test_the_figure_is_drawn(tmp_path):
    draw(read(), tmp_path / "steering.png")
    assert (tmp_path / "steering.png").stat().st_size > 10_000
