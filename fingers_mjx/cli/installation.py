"""Checks of what is installed, before anything heavy is imported."""

import importlib.util
import platform
from importlib import metadata
from pathlib import Path

from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet

DISTRIBUTION = "fingers-mjx"
OURS = ("rewards", "envs", "sysid")


class UnsupportedInstallation(RuntimeError):
    """What is installed cannot work together, in one sentence (status 6)."""

    exit_code = 6


def check_installation() -> None:
    """Checks the versions that this distribution asks for.

    Brax fails on newer versions of JAX, some versions of jaxlib hang on the CPU, and an
    installer that is asked for another package may well change them: so the versions
    are checked whenever a command starts, against the distribution's own metadata.

    Raises:
        UnsupportedInstallation: naming the first package, what was found and what
            would be valid.
    """
    try:
        own = metadata.metadata(DISTRIBUTION)
    except metadata.PackageNotFoundError:
        return  # run from a source tree without having been installed
    check_python(platform.python_version(), own["Requires-Python"] or "")
    for text in metadata.requires(DISTRIBUTION) or []:
        check_requirement(text)


def check_places(root: Path = Path(__file__).parents[2]) -> None:
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
    if not SpecifierSet(valid).contains(found, prereleases=True):
        raise UnsupportedInstallation(f"Python: found {found}; valid: {valid}")


def check_requirement(text: str) -> None:
    """Raises if a requirement of ours is not met by what is installed.

    Args:
        text: as in package metadata, such as "jax<0.10,>=0.8.1"; requirements of
            extras are not looked at.

    Raises:
        UnsupportedInstallation: naming the package, its version and the valid ones.
    """
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
