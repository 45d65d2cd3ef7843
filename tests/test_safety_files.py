"""What is written names nothing of the machine or the person, and is readable (X8)."""

import getpass
import platform
import socket

import pytest
from support import cli_setup, train_setup

SECRET = "zq7x"
"""Stands in the name of user, machine, home and place, and nowhere else."""


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A run that was trained, one with a checkpoint, and a bundle."""
    root = tmp_path_factory.mktemp(f"{SECRET}-place")
    names = ("USER", "LOGNAME", "HOSTNAME", "HOME", "API_TOKEN")
    with pytest.MonkeyPatch.context() as patch:
        for name in names:
            patch.setenv(name, f"/{SECRET}-{name.lower()}")
        for module, name in ((socket, "gethostname"), (platform, "node")):
            patch.setattr(module, name, lambda: f"{SECRET}-machine")
        assert SECRET in getpass.getuser()
        train_setup.run(root / "trained", iterations=2)
        setup = cli_setup.make_setup()
        cli_setup.make_run(root / "run", setup)
        cli_setup.make_bundle(root / "bundle", setup)
    return root


def telling(files):
    """Files whose name or contents hold the secret."""
    return [
        path.name
        for path in files
        if SECRET in path.name or SECRET.encode() in path.read_bytes()
    ]


@pytest.mark.parametrize("folder", ["trained", "run", "bundle"])
def test_files_name_neither_person_nor_machine_nor_place(place, folder):
    files = [path for path in (place / folder).rglob("*") if path.is_file()]
    assert len(files) > 3
    assert telling(files) == []


def test_the_search_finds_a_name(place, tmp_path):
    """Negative control."""
    (tmp_path / "note").write_bytes(b"\x00by zq7x-user\x00")
    (tmp_path / "events.zq7x-machine").write_bytes(b"")
    assert sorted(telling(tmp_path.iterdir())) == ["events.zq7x-machine", "note"]


def test_everyone_may_read_and_only_the_owner_may_write(place):
    modes = {
        path.is_dir(): set() for path in (place, place / "bundle" / "manifest.json")
    }
    for path in place.rglob("*"):
        modes[path.is_dir()].add(path.stat().st_mode & 0o777)
    assert modes == {True: {0o755}, False: {0o644}}
