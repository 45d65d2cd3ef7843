"""Checks of what is installed, before anything heavy is imported."""

import importlib.util
import platform
import tomllib
from importlib import metadata
from pathlib import Path
from typing import Any

DISTRIBUTION = "fingers-mjx"
OURS = ("rewards", "envs", "sysid")
ROOT = Path(__file__).parents[3]
"""Directory from which `fingers_mjx` was imported."""


class UnsupportedInstallation(RuntimeError):
    """What is installed cannot work together, in one sentence (status 6)."""

    exit_code = 6


def check_installation(root: Path = ROOT) -> None:
    """Checks the versions that this distribution asks for.

    Some versions of jaxlib hang on the CPU, and an installer that is asked for another
    package may well change them: so the versions are checked whenever a command starts,
    against `pyproject.toml` in a checkout, installed or not, and against the
    distribution's own metadata elsewhere.

    Args:
        root: directory from which `fingers_mjx` was imported.

    Raises:
        UnsupportedInstallation: naming the first package, what was found and what
            would be valid.
    """
    if importlib.util.find_spec("packaging") is None:  # it compares the versions
        raise UnsupportedInstallation(
            "packaging: found nothing; valid: any version (pip install packaging)"
        )
    python, texts = requirements(root)
    check_python(platform.python_version(), python)
    for text in texts:
        check_requirement(text)


def requirements(root: Path = ROOT) -> tuple[str, list[str]]:
    """Returns the Python versions and the packages that we ask for.

    Args:
        root: directory from which `fingers_mjx` was imported.

    Raises:
        UnsupportedInstallation: nothing says so, or a package beside ours is missing.
    """
    table = source_tree(root)
    return _installed() if table is None else _asked_by(table, root)


def source_tree(root: Path = ROOT) -> dict[str, Any] | None:
    """Returns `pyproject.toml` of the checkout from which our code runs, or None."""
    try:
        text = (root / "pyproject.toml").read_text("utf-8")
    except FileNotFoundError:
        return None
    table = tomllib.loads(text)
    return table if table.get("project", {}).get("name") == DISTRIBUTION else None


def version(root: Path = ROOT) -> str:
    """Returns our version: that of the checkout, or of the installed package.

    Args:
        root: directory from which `fingers_mjx` was imported.

    Raises:
        UnsupportedInstallation: nothing says it.
    """
    table = source_tree(root)
    return _metadata()["Version"] if table is None else table["project"]["version"]


def _installed() -> tuple[str, list[str]]:
    """Python versions and requirements in the metadata of the installed package."""
    own = _metadata()
    return own["Requires-Python"] or "", metadata.requires(DISTRIBUTION) or []


def _metadata() -> metadata.PackageMetadata:
    try:
        return metadata.metadata(DISTRIBUTION)
    except metadata.PackageNotFoundError as error:
        raise UnsupportedInstallation(
            f"{DISTRIBUTION}: found nothing that says what it needs; valid: an "
            "installed package, or a whole checkout with its pyproject.toml"
        ) from error


def _asked_by(table: dict[str, Any], root: Path) -> tuple[str, list[str]]:
    """The same of a source tree, without the package that it brings along itself."""
    from packaging.requirements import Requirement

    project, beside = table["project"], table["tool"]["uv"]["sources"]
    for name in beside:
        if importlib.util.find_spec(name.replace("-", "_")) is None:
            place = root / "deploy"
            raise UnsupportedInstallation(
                f"{name}: found nothing; valid: {place}, installed or on PYTHONPATH"
            )
    texts = project["dependencies"]
    foreign = [text for text in texts if Requirement(text).name not in beside]
    return project["requires-python"], foreign


def check_places(root: Path = ROOT) -> None:
    """Raises if one of our packages with a common name is somebody else's.

    Before anything of them is imported.

    Args:
        root: directory from which `fingers_mjx` was imported.

    Raises:
        UnsupportedInstallation: naming the package and where it was found.
    """
    for name in OURS:
        spec = importlib.util.find_spec(name)
        places = list(spec.submodule_search_locations or []) if spec else []
        found = places[0] if places else (spec and spec.origin) or "nothing"
        if not places or Path(places[0]).resolve() != (root / name).resolve():
            raise UnsupportedInstallation(
                f"package {name}: found {found}; valid: {root / name}, so install "
                f"{DISTRIBUTION} into an environment of its own and run it from a "
                f"directory without {name}"
            )


def check_python(found: str, valid: str) -> None:
    """Raises if Python `found` is not one of `valid`, such as ">=3.11,<3.13"."""
    from packaging.specifiers import SpecifierSet

    if not SpecifierSet(valid).contains(found, prereleases=True):
        raise UnsupportedInstallation(f"Python: found {found}; valid: {valid}")


def check_requirement(text: str) -> None:
    """Raises if a requirement of ours is not met by what is installed.

    Args:
        text: as in package metadata, such as "jax<0.12,>=0.8.1"; requirements of
            extras are not looked at.

    Raises:
        UnsupportedInstallation: naming the package, its version and the valid ones.
    """
    from packaging.requirements import Requirement

    wanted = Requirement(text)
    if wanted.marker and not wanted.marker.evaluate({"extra": ""}):
        return
    try:
        found = metadata.version(wanted.name)
    except metadata.PackageNotFoundError:
        found = "nothing"
    valid = str(wanted.specifier)
    if found == "nothing" or not wanted.specifier.contains(found, prereleases=True):
        raise UnsupportedInstallation(
            f"{wanted.name}: found {found}; valid: {valid or 'any version'} "
            f'(pip install "{wanted.name}{valid}")'
        )
