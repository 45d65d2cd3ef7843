"""Versions that cannot work and packages in our place are reported at once.

T11 (the range of jaxlib that hangs on the CPU) and X6 (floors and exclusions).
"""

import itertools
import os
import subprocess
import sys
import tomllib
from importlib import metadata
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from packaging.version import Version

from fingers_mjx.cli import installation
from fingers_mjx.cli.installation import (
    UnsupportedInstallation,
    check_installation,
    check_places,
    check_python,
    check_requirement,
)
from fingers_mjx.cli.main import main

ROOT = Path(__file__).parents[3]
NEVER = {
    "jax": ["0.10.0", "0.10.1", "0.10.2", "0.11.0", "0.12.0"],
    "jaxlib": ["0.10.0", "0.10.1", "0.10.2", "0.11.0"],
    "mujoco": ["4.0.0"],
    "onnx": ["1.20.0"],
    "onnxruntime": ["1.21.0"],
    "pyarrow": ["22.0.0", "23.0.0"],
}
"""Versions with which something hangs, crashes or can be exploited."""


def test_what_is_installed_here_is_supported():
    check_installation()


@pytest.mark.parametrize("version", ["0.8.0", "0.10.0", "0.10.2", "0.11.0", "0.12.0"])
def test_unsupported_jax_is_refused_before_it_is_imported(monkeypatch, capsys, version):
    real = metadata.version
    fake = {"jax": version}
    monkeypatch.setattr(
        installation.metadata, "version", lambda name: fake.get(name) or real(name)
    )
    assert main(["train", "no-task"]) == 6
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1
    assert f"jax: found {version}; valid: <0.10,>=0.8.1" in said.err


@pytest.mark.parametrize("version", ["3.10.14", "3.13.0"])
def test_unsupported_python_is_refused(version):
    with pytest.raises(UnsupportedInstallation, match=f"found {version}"):
        check_python(version, ">=3.11,<3.13")


def test_missing_package_is_named():
    check_requirement('no-such-package>=1; extra == "viz"')
    with pytest.raises(UnsupportedInstallation, match="no-such-package: found nothing"):
        check_requirement("no-such-package>=1")


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        *itertools.product(installation.OURS, ["package", "module"]),
        ("rewards", "namespace"),
    ],
)
def test_foreign_package_in_our_place_is_reported(tmp_path, name, kind):
    """One sentence and status 6 from a directory that holds something of that name."""
    place = tmp_path / name if kind != "module" else tmp_path / f"{name}.py"
    place.write_text("") if kind == "module" else place.mkdir()
    if kind == "package":
        (place / "__init__.py").write_text("")
    path = os.pathsep.join([str(tmp_path), str(ROOT), str(ROOT / "deploy")])
    done = subprocess.run(
        [sys.executable, "-m", "fingers_mjx.cli.main", "train", "no-task"],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=False,
    )
    if kind == "namespace":  # Python prefers ours, further on, to one without __init__
        assert done.returncode == 2 and "no-task" in done.stderr
        return
    assert done.returncode == 6
    assert done.stderr.count("\n") == 1
    assert f"package {name}: found {place}" in done.stderr


def test_our_own_packages_are_in_their_place():
    check_places(ROOT)
    with pytest.raises(UnsupportedInstallation, match="package rewards"):
        check_places(ROOT / "deploy")


def requirements():
    """Every requirement of both distributions, extras and groups included."""
    for directory in (ROOT, ROOT / "deploy"):
        table = tomllib.loads((directory / "pyproject.toml").read_text("utf-8"))
        project = table["project"]
        lists = [
            project["dependencies"],
            *project.get("optional-dependencies", {}).values(),
            *table.get("dependency-groups", {}).values(),
        ]
        yield from (Requirement(text) for texts in lists for text in texts)


def test_known_bad_versions_cannot_be_installed():
    """X6: neither by the requirements nor by the lock file."""
    named = set()
    for requirement in requirements():
        name = canonicalize_name(requirement.name)
        named.add(name)
        for bad in NEVER.get(name, []):
            assert not requirement.specifier.contains(bad), (
                f"{requirement} admits {bad}"
            )
    assert set(NEVER) - {"jaxlib"} <= named
    lock = tomllib.loads((ROOT / "uv.lock").read_text("utf-8"))
    locked = [(p["name"], p["version"]) for p in lock["package"] if "version" in p]
    for name, versions in NEVER.items():
        found = {Version(version) for own, version in locked if own == name}
        assert found and not found & set(map(Version, versions)), name
