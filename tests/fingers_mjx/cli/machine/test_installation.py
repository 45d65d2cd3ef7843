"""Versions that cannot work and packages in our place are reported at once.

T11 (the range of jaxlib that hangs on the CPU) and X6 (floors and exclusions).
"""

import itertools
import os
import shutil
import subprocess
import sys
import sysconfig
import tomllib
from importlib import metadata
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from packaging.version import Version

from fingers_mjx.cli.machine import installation
from fingers_mjx.cli.machine.installation import (
    UnsupportedInstallation,
    check_installation,
    check_places,
    check_python,
    check_requirement,
    version,
)
from fingers_mjx.cli.main import main

ROOT = Path(__file__).parents[4]
NEVER = {
    "jax": ["0.10.0", "0.10.1", "0.10.2", "0.11.0"],
    "jaxlib": ["0.10.0", "0.10.1", "0.10.2", "0.11.0"],
    "mujoco": ["4.0.0"],
    "onnx": ["1.20.0"],
    "onnxruntime": ["1.21.0"],
    "pyarrow": ["22.0.0", "23.0.0"],
}
"""Versions with which something hangs, crashes or can be exploited."""

INSTALLED = metadata.version


def test_what_is_installed_here_is_supported():
    check_installation()


def pretend(monkeypatch, **versions):
    """Lets packages seem installed in other versions; None is not at all."""

    def version(name):
        if (found := versions.get(name, INSTALLED(name))) is None:
            raise metadata.PackageNotFoundError(name)
        return found

    monkeypatch.setattr(installation.metadata, "version", version)


@pytest.mark.parametrize("version", ["0.8.0", "0.10.0", "0.10.2", "0.11.0", "0.12.0"])
def test_unsupported_jax_is_refused_before_it_is_imported(monkeypatch, capsys, version):
    pretend(monkeypatch, jax=version)
    assert main(["train", "no-task"]) == 6
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1
    assert f"jax: found {version}; valid: !=0.10.*,!=0.11.0,<0.12,>=0.8.1" in said.err


@pytest.mark.parametrize("version", ["0.8.1", "0.9.2", "0.11.1", "0.11.2"])
def test_supported_jax_is_not_refused(monkeypatch, version):
    """Negative control."""
    pretend(monkeypatch, jax=version)
    check_installation()


@pytest.fixture
def source(tmp_path):
    """A checkout of which nothing is installed."""
    tree = tmp_path / "tree"
    (tree / "deploy").mkdir(parents=True)
    for file in ("pyproject.toml", "deploy/pyproject.toml"):
        shutil.copy(ROOT / file, tree / file)
    return tree


def without_ours(monkeypatch, **versions):
    ours = {"fingers-mjx": None, "fingers-deploy": None}
    pretend(monkeypatch, **ours | versions)

    def nothing(name):
        raise metadata.PackageNotFoundError(name)

    monkeypatch.setattr(installation.metadata, "metadata", nothing)


def test_a_checkout_is_checked_without_having_been_installed(monkeypatch, source):
    without_ours(monkeypatch)
    check_installation(source)
    without_ours(monkeypatch, jax="0.10.1")
    with pytest.raises(UnsupportedInstallation, match=r"jax: found 0\.10\.1"):
        check_installation(source)
    without_ours(monkeypatch, scipy=None)
    with pytest.raises(UnsupportedInstallation, match="scipy: found nothing"):
        check_installation(source)


def test_an_installed_package_is_checked_by_its_metadata(monkeypatch, tmp_path):
    """The file of another project beside it, as some packages leave, is not ours."""
    (tmp_path / "pyproject.toml").write_text('[project]\nname = "other"\n')
    asked = ["jax>=99", 'pyarrow>=99; extra == "viz"']
    monkeypatch.setattr(installation.metadata, "requires", lambda name: asked)
    with pytest.raises(UnsupportedInstallation, match="jax: found"):
        check_installation(tmp_path)
    monkeypatch.setattr(installation.metadata, "requires", lambda name: asked[1:])
    check_installation(tmp_path)


def test_a_checkout_without_its_shim_says_where_that_is(monkeypatch, source):
    real = installation.importlib.util.find_spec
    monkeypatch.setattr(
        installation.importlib.util,
        "find_spec",
        lambda name: None if name == "fingers_deploy" else real(name),
    )
    with pytest.raises(UnsupportedInstallation, match=f"valid: {source / 'deploy'}"):
        check_installation(source)


def test_code_that_says_nowhere_what_it_needs_is_refused(monkeypatch, tmp_path):
    without_ours(monkeypatch)
    with pytest.raises(UnsupportedInstallation, match="fingers-mjx: found nothing"):
        check_installation(tmp_path)


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


COMMON = ("rewards", "envs", "sysid")
"""Each needs those before it."""


@pytest.mark.parametrize(
    ("foreign", "imported"),
    [*itertools.permutations(COMMON, 2), ("envs", "sysid.logs.read")],
)
def test_importing_ours_beside_a_foreign_package_is_the_same_sentence(
    tmp_path, foreign, imported
):
    (tmp_path / foreign).mkdir()
    (tmp_path / foreign / "__init__.py").touch()
    path = os.pathsep.join([str(tmp_path), str(ROOT), str(ROOT / "deploy")])

    def imports(*paths):
        return subprocess.run(
            [sys.executable, "-c", f"import {imported}"],
            cwd=tmp_path.parent,
            env=os.environ | {"PYTHONPATH": os.pathsep.join(paths)},
            capture_output=True,
            text=True,
            check=False,
        )

    done = imports(path)
    needed = COMMON.index(foreign) < COMMON.index(imported.partition(".")[0])
    assert done.returncode == needed
    said = done.stderr.splitlines()[-1]
    assert ("ImportError: " if needed else "UserWarning: ") in done.stderr
    assert f"package {foreign}: found {tmp_path}" in said
    assert f"run it from a directory without {foreign}" in said
    assert imports(str(ROOT), str(ROOT / "deploy")).returncode == 0


def test_rewards_alone_need_none_of_the_others(tmp_path):
    """What is absent is no mistake; -S leaves the checkout out."""
    shutil.copytree(ROOT / "rewards", tmp_path / "rewards")
    done = subprocess.run(
        [sys.executable, "-S", "-c", "import rewards; print(rewards); import envs"],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": sysconfig.get_path("purelib")},
        capture_output=True,
        text=True,
        check=False,
    )
    assert str(tmp_path) in done.stdout
    assert done.stderr.endswith("ModuleNotFoundError: No module named 'envs'\n")


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


def test_the_version_is_printed_from_a_checkout_and_from_metadata(capsys, tmp_path):
    assert version() == version(tmp_path) == metadata.version("fingers-mjx")
    with pytest.raises(SystemExit) as done:
        main(["--version"])
    assert done.value.code == 0
    assert capsys.readouterr().out == f"fingers-mjx {version()}\n"


def test_a_copy_without_metadata_has_no_version(monkeypatch, tmp_path):
    without_ours(monkeypatch)
    with pytest.raises(UnsupportedInstallation, match="found nothing that says"):
        version(tmp_path)


def test_known_bad_versions_cannot_be_installed():
    """X6: neither by the requirements nor by the lock file."""
    named = set()
    for requirement in requirements():
        name = canonicalize_name(requirement.name)
        if requirement.extras and not requirement.specifier:  # bounded elsewhere
            continue
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
