"""Environments of the peers: made from pinned requirements, apart from our own."""

import shutil
import subprocess
import sys
from pathlib import Path

REQUIREMENTS = Path(__file__).parent / "requirements"
ROOT = Path(__file__).parents[2]
OURS = "fingers_mjx"
WITH_OURS = ("sysid",)
"""Environments that also hold this project, for two tools in one process."""


class CannotInstallError(Exception):
    """A peer that this machine does not take; the message says why."""


def python_of(peer: str, folder: Path) -> Path:
    """Returns the interpreter of a peer's environment and makes it where it is missing.

    Args:
        peer: `fingers_mjx` for this very environment, else a file of requirements.
        folder: of the environments.

    Raises:
        CannotInstallError: uv is missing, or a package cannot be had.
    """
    if peer == OURS:
        return Path(sys.executable)
    place, done = folder / peer, folder / peer / "installed"
    python = place / "bin" / "python"
    if not done.exists():
        print(f"{peer}: making its environment", flush=True)
        _uv("venv", "--quiet", "--clear", "--python", "3.11", str(place))
        wanted = ["-r", str(REQUIREMENTS / f"{peer}.txt")]
        if peer in WITH_OURS:
            wanted += ["--editable", str(ROOT), "--editable", str(ROOT / "deploy")]
        _uv("pip", "install", "--quiet", "--python", str(python), *wanted)
        done.touch()
    return python


def version_of(package: str, peer: str) -> str:
    """Returns the version of a package that a peer's requirements pin."""
    for line in (REQUIREMENTS / f"{peer}.txt").read_text(encoding="utf-8").split("\n"):
        name, _, version = line.strip().partition("==")
        if name.partition("[")[0] == package:
            return version
    raise KeyError(f"{package} is not pinned in {peer}.txt")


def _uv(*words: str) -> None:
    uv = shutil.which("uv") or str(ROOT / ".uv/bin/uv")
    try:
        done = subprocess.run([uv, *words], capture_output=True, text=True, check=False)
    except OSError as error:
        raise CannotInstallError(f"uv does not start: {error}") from None
    if done.returncode:
        raise CannotInstallError(" ".join(done.stderr.split())[-300:])
