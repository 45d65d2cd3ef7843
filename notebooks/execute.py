"""Executes the notebooks: from their text to an .ipynb with its outputs.

    python -m notebooks.execute          # all, as `make notebooks`
    python -m notebooks.execute 2 6      # some, by number

A notebook is the Jupytext file `N_name.py`; the `.ipynb` beside it is made of it and
never edited. NOTEBOOK_FAST=1 in the environment makes everything small, as tests do.
"""

import base64
import hashlib
import io
import re
import sys
import tempfile
import time
from pathlib import Path

import jupytext
import nbformat
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError
from nbformat import NotebookNode
from PIL import Image

HERE = Path(__file__).parent
SOURCES = sorted(HERE.glob("[0-9]*_*.py"))
CELL_TIMEOUT_S = 900
COLOURS = 256
CONTROL = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]")
METADATA = {
    "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
    "language_info": {"name": "python", "file_extension": ".py"},
}
"""What is kept of a notebook's metadata: nothing of the machine that ran it."""


def main(numbers: list[str]) -> int:
    """Executes the notebooks with these numbers, or all; returns the exit status."""
    known = {path.name.split("_")[0]: path for path in SOURCES}
    unknown = [number for number in numbers if number not in known]
    if unknown:
        print(f"no notebook {', '.join(unknown)}; valid: {', '.join(known)}")
        return 2
    for path in [known[number] for number in numbers or known]:
        start_s = time.monotonic()
        print(f"{path.stem} ...", end=" ", flush=True)
        try:
            notebook = execute(path)
        except CellExecutionError as error:
            print(f"failed\n{error}")
            return 1
        target = path.with_suffix(".ipynb")
        nbformat.write(notebook, target)
        size_kb = target.stat().st_size / 1000
        print(f"{time.monotonic() - start_s:.0f} s, {size_kb:.0f} kB", flush=True)
    return 0


def execute(source: Path) -> NotebookNode:
    """Runs a Jupytext file in a kernel and an empty folder of its own.

    Args:
        source: the text of the notebook.

    Raises:
        CellExecutionError: a cell failed.
    """
    notebook = cells_of(source)
    with tempfile.TemporaryDirectory() as folder:
        resources = {"metadata": {"path": folder}}
        client = NotebookClient(
            notebook,
            timeout=CELL_TIMEOUT_S,
            kernel_name="python3",
            resources=resources,
            coalesce_streams=True,  # so that progress is one line
        )
        client.execute()
        return cleaned(notebook, [folder, str(HERE.parent)])


def cells_of(source: Path) -> NotebookNode:
    """Returns the cells of a Jupytext file, with ids that follow from their text."""
    notebook = jupytext.read(source, fmt="py:percent")
    for number, cell in enumerate(notebook.cells):
        digest = hashlib.sha256(cell.source.encode()).hexdigest()
        cell.id = f"{number:02}-{digest[:8]}"
        cell.metadata = NotebookNode()
    notebook.metadata = nbformat.from_dict(METADATA)
    return notebook


def cleaned(notebook: NotebookNode, places: list[str]) -> NotebookNode:
    """Removes from the outputs what differs from machine to machine.

    Times of execution and what libraries write to stderr go; of lines that rewrite
    themselves (progress) the last state stays, without control sequences.

    Args:
        notebook: as executed.
        places: folders of this machine whose paths are shortened to what is below.
    """
    notebook.metadata = nbformat.from_dict(METADATA)
    for cell in notebook.cells:
        cell.metadata = NotebookNode()
        if cell.cell_type == "code":
            kept = [o for o in cell.outputs if o.get("name") != "stderr"]
            cell.outputs = [_output(output, places) for output in kept]
    return notebook


def _output(output: NotebookNode, places: list[str]) -> NotebookNode:
    if output.output_type == "stream":
        output.text = _text(output.text, places)
    elif "data" in output:
        output.metadata = NotebookNode()
        data = output.data
        if "image/png" in data:  # the words "<Figure ...>" beside it say nothing
            data.pop("text/plain", None)
            data["image/png"] = _smaller(data["image/png"])
        for kind in [kind for kind in data if kind.startswith("text/")]:
            data[kind] = _text(data[kind], places)
    return output


def _smaller(png: str) -> str:
    """Returns a picture with a palette, a third of the bytes.

    An octree keeps the colours of small things, which a median cut does not.
    """
    image = Image.open(io.BytesIO(base64.b64decode(png))).convert("RGB")
    memory = io.BytesIO()
    few = image.quantize(COLOURS, method=Image.Quantize.FASTOCTREE)
    few.save(memory, "PNG", optimize=True)
    return base64.b64encode(memory.getvalue()).decode()


def _text(text: str, places: list[str]) -> str:
    for place in places:
        text = text.replace(f"{place}/", "").replace(place, ".")
    lines = CONTROL.sub("", text).split("\n")
    return "\n".join(line.rstrip("\r").split("\r")[-1] for line in lines)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
