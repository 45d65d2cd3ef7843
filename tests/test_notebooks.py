"""The notebooks: their text runs, and what is committed of them is made of it."""

import base64
import io
import re
import runpy

import jax
import nbformat
import numpy as np
import pytest
from nbformat import NotebookNode
from nbformat.v4 import new_code_cell, new_notebook, new_output
from PIL import Image

from envs import registry
from notebooks.execute import SOURCES, cells_of, cleaned, main

PLACES = re.compile(r"/(work|tmp|home|root)/|localhost", re.IGNORECASE)
FOLDER = SOURCES[0].parent
MOST_BYTES = 400_000


def named(path):
    return path.stem


def outputs(notebook):
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    return [output for cell in code for output in cell.outputs]


@pytest.fixture
def quickly_compiled():
    """Programs that run for a moment are not worth optimizing."""
    jax.config.update("jax_disable_most_optimizations", True)
    yield
    jax.config.update("jax_disable_most_optimizations", False)


@pytest.mark.usefixtures("quickly_compiled")
@pytest.mark.parametrize("source", SOURCES, ids=named)
def test_notebooks_run(source, tmp_path, monkeypatch):
    monkeypatch.setenv("NOTEBOOK_FAST", "1")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(registry, "_TASKS", dict(registry._TASKS))
    made = runpy.run_path(str(source))
    assert made["FAST"]
    if "diagnosis" in made:
        assert_finds_what_is_hidden(made)


def assert_finds_what_is_hidden(made):
    """A small record must not teach a wrong answer."""
    (cause,) = made["diagnosis"].causes
    width = cause.parameters["half_width_rad"]
    assert (cause.effect, cause.where) == ("deadband", "arm")
    assert width.value == pytest.approx(made["HIDDEN_RAD"], rel=0.1)


@pytest.mark.parametrize("source", SOURCES, ids=named)
def test_the_executed_notebook_is_that_of_its_text(source):
    executed = source.with_suffix(".ipynb")
    wanted = [(c.id, c.cell_type, c.source) for c in cells_of(source).cells]
    found = [(c.id, c.cell_type, c.source) for c in nbformat.read(executed, 4)["cells"]]
    assert found == wanted, "make notebooks"


@pytest.mark.parametrize("source", SOURCES, ids=named)
def test_what_is_committed_draws_and_names_no_machine(source):
    executed = source.with_suffix(".ipynb")
    assert executed.stat().st_size < MOST_BYTES
    shown = outputs(nbformat.read(executed, 4))
    assert [o for o in shown if o.output_type == "error"] == []
    pictures = [o for o in shown if "image/png" in o.get("data", {})]
    assert len(pictures) >= 2
    texts = [o.get("text") or o.get("data", {}).get("text/plain", "") for o in shown]
    assert [text for text in texts if PLACES.search(text)] == []


def test_every_notebook_has_a_text_and_an_execution():
    executed = sorted(p.with_suffix(".py") for p in FOLDER.glob("[0-9]*.ipynb"))
    assert executed == SOURCES


def test_an_unknown_number_is_refused(capsys):
    assert main(["99"]) == 2
    assert "valid: " in capsys.readouterr().out


PIXEL = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mP8z8BQDwAEhQGAhKmMIQAA"
    "AABJRU5ErkJggg=="
)


def test_outputs_lose_what_belongs_to_one_machine():
    noise = new_output("stream", name="stderr", text="W0000 a warning")
    bar = new_output("stream", name="stdout", text="10 %\r\x1b[2K100 %\nin /x/y/z\n")
    data = {"image/png": base64.b64encode(PIXEL).decode(), "text/plain": "<Figure>"}
    picture = new_output("display_data", data=data)
    cell = new_code_cell("1", outputs=[noise, bar, picture])
    cell.metadata = NotebookNode(execution={"iopub.status.busy": "2026"})
    (made,) = cleaned(new_notebook(cells=[cell]), ["/x/y"]).cells
    assert made.metadata == {}
    assert [o.get("text") for o in made.outputs] == ["100 %\nin z\n", None]
    assert set(made.outputs[1].data) == {"image/png"}


def test_a_smaller_picture_keeps_the_colours_of_small_things():
    """Five fingers in a picture that is mostly shades of grey."""
    rng = np.random.default_rng(0)
    shade = rng.integers(90, 240, (300, 400, 1)) + rng.integers(-9, 10, (300, 400, 3))
    pixels = shade.astype(np.uint8)
    hues = [
        (214, 39, 40),
        (44, 160, 44),
        (31, 119, 180),
        (255, 127, 14),
        (148, 103, 189),
    ]
    for k, hue in enumerate(hues):
        pixels[10:16, 20 * k : 20 * k + 6] = hue
    memory = io.BytesIO()
    Image.fromarray(pixels).save(memory, "PNG")
    png = base64.b64encode(memory.getvalue()).decode()
    picture = new_output("display_data", {"image/png": png})
    cell = new_code_cell("", outputs=[picture])
    (small,) = outputs(cleaned(new_notebook(cells=[cell]), []))
    data = base64.b64decode(small.data["image/png"])
    kept = np.asarray(Image.open(io.BytesIO(data)).convert("RGB")).astype(int)
    for k, hue in enumerate(hues):
        assert np.abs(kept[13, 20 * k + 3] - hue).max() <= 24
