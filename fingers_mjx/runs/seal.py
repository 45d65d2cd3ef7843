"""Manifest of a directory: what is in it, byte for byte."""

import hashlib
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from envs.config.atomic_file import sync
from fingers_deploy.files import read_regular

NAME = "manifest.json"
_MAX_BYTES = 1 << 24


def seal(directory: Path, step: int) -> None:
    """Writes the manifest of all files in `directory`, then forces all to the disk.

    Files get mode 0644 and directories 0755. The manifest is the last file written.
    """
    files = {str(p.relative_to(directory)): _entry(p) for p in _files(directory)}
    (directory / NAME).write_bytes(_encode({"step": step, "files": files}))
    for path in sorted(directory.rglob("*")):
        path.chmod(0o755 if path.is_dir() else 0o644)
        sync(path)
    directory.chmod(0o755)
    sync(directory)


def problem(directory: Path, step: int) -> str:
    """Returns what is wrong with the sealed `directory` of `step`; empty if nothing.

    Every deleted, added, truncated or altered file is found, the manifest included.
    """
    try:
        content = read_regular(directory / NAME, _MAX_BYTES)
        manifest = json.loads(content)["manifest"]
        if content != _encode(manifest) or manifest["step"] != step:
            return f"{NAME} was altered"
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return f"{NAME} is missing or unreadable"
    if odd := _special(directory):
        return odd
    names = {str(p.relative_to(directory)) for p in _files(directory)} - {NAME}
    for name in sorted(names ^ manifest["files"].keys()):
        return f"{name} is {'not in the manifest' if name in names else 'missing'}"
    for name, entry in manifest["files"].items():
        if _entry(directory / name) != entry:
            return f"{name} was altered"
    return ""


def _files(directory: Path) -> Iterator[Path]:
    """Yields the files in `directory`, at any depth, in order."""
    return (p for p in sorted(directory.rglob("*")) if not p.is_dir())


def _special(directory: Path) -> str:
    """Names what is neither file nor folder, which nobody may open."""
    odd = (p for p in _files(directory) if not p.is_file())
    return next((f"{p.relative_to(directory)} is no regular file" for p in odd), "")


def _entry(path: Path) -> dict[str, Any]:
    """Returns size and SHA-256 of a file."""
    with path.open("rb") as file:
        digest = hashlib.file_digest(file, "sha256").hexdigest()
    return {"bytes": path.stat().st_size, "sha256": digest}


def _encode(manifest: dict[str, Any]) -> bytes:
    """Returns the one way to write `manifest`, with its own SHA-256."""
    body = json.dumps(manifest, sort_keys=True)
    digest = hashlib.sha256(body.encode()).hexdigest()
    whole = {"manifest": manifest, "sha256": digest}
    return (json.dumps(whole, sort_keys=True, indent=1) + "\n").encode()
