"""The code of the notebooks runs, with less of everything."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

NOTEBOOKS = sorted((Path(__file__).parents[1] / "notebooks").glob("*.ipynb"))


def code(path):
    """The code cells of a notebook, one after the other."""
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    return "\n".join("".join(c["source"]) for c in cells if c["cell_type"] == "code")


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebooks_are_committed_without_outputs(path):
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    assert all(not cell.get("outputs") for cell in cells)
    compile(code(path), str(path), "exec")


@pytest.mark.slow
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebooks_run(path, tmp_path):
    (tmp_path / "cells.py").write_text(code(path), encoding="utf-8")
    few = {"SECONDS": "30", "EPISODES": "2"}
    few = {f"NOTEBOOK_{name}": value for name, value in few.items()}
    few["NOTEBOOK_OUT"] = str(tmp_path / "out")
    subprocess.run(
        [sys.executable, "cells.py"], cwd=tmp_path, env=os.environ | few, check=True
    )
