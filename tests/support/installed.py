"""Packages that are installed for a test: a folder on the path with entry points."""

import importlib
import tomllib
from pathlib import Path

from support.house import ROOT

from envs.config import plugins

EXAMPLE = ROOT / "examples/outside_task"


def install(monkeypatch, folder, name, entry_points):
    """Puts a distribution on the path, with entry points by group and name."""
    info = Path(folder) / f"{name.replace('-', '_')}-0.1.0.dist-info"
    info.mkdir()
    text = f"Metadata-Version: 2.4\nName: {name}\nVersion: 0.1.0\n"
    (info / "METADATA").write_text(text, "utf-8")
    lines = [
        line
        for group, points in entry_points.items()
        for line in (f"[{group}]", *(f"{k} = {v}" for k, v in points.items()))
    ]
    (info / "entry_points.txt").write_text("\n".join(lines), "utf-8")
    monkeypatch.syspath_prepend(str(folder))
    importlib.invalidate_caches()
    plugins.found.cache_clear()


def install_example(monkeypatch, folder):
    """Installs `examples/outside_task`, as its pyproject.toml says."""
    project = tomllib.loads((EXAMPLE / "pyproject.toml").read_text("utf-8"))["project"]
    monkeypatch.syspath_prepend(str(EXAMPLE))
    install(monkeypatch, folder, project["name"], project["entry-points"])
