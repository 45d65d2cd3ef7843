"""A file is whole, old or new, whatever happens while it is written."""

import os
import stat

import pytest

from envs.config import atomic_file
from envs.config.atomic_file import atomic_path, write_atomic, write_atomic_set


def full_disk(*_, **__):
    raise OSError(28, "No space left on device")


def test_text_and_bytes_arrive_readable_by_all(tmp_path):
    previous = os.umask(0o077)
    try:
        path = write_atomic(tmp_path / "a.txt", "größer\n")
    finally:
        os.umask(previous)
    assert path.read_bytes() == "größer\n".encode()
    assert stat.S_IMODE(path.stat().st_mode) == 0o644
    assert write_atomic(path, b"\x00").read_bytes() == b"\x00"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("step", ["fsync", "replace", "chmod"])
def test_a_failed_write_leaves_the_old_file(tmp_path, monkeypatch, step):
    path = write_atomic(tmp_path / "a.json", b"old")
    with monkeypatch.context() as patch:
        patch.setattr(atomic_file.os, step, full_disk)
        with pytest.raises(OSError, match="No space"):
            write_atomic(path, b"new")
        with pytest.raises(OSError, match="No space"), atomic_path(path) as part:
            part.write_bytes(b"new")
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_no_file_of_a_set_is_replaced_before_all_are_on_the_disk(tmp_path, monkeypatch):
    one, two = tmp_path / "one", tmp_path / "two"
    write_atomic_set({one: b"old", two: b"old"})
    synced, plain = [], atomic_file.os.fsync

    def second_fails(handle):
        synced.append(handle)
        full_disk() if len(synced) == 2 else plain(handle)

    monkeypatch.setattr(atomic_file.os, "fsync", second_fails)
    with pytest.raises(OSError, match="No space"):
        write_atomic_set({one: b"new", two: b"new"})
    assert one.read_bytes() == two.read_bytes() == b"old"
    assert sorted(tmp_path.iterdir()) == [one, two]


def test_a_library_writes_under_a_name_of_the_same_kind(tmp_path):
    path = tmp_path / "video.mp4"
    with atomic_path(path) as part:
        assert part.suffix == ".mp4" and part.parent == tmp_path
        part.write_bytes(b"frames")
        assert not path.exists()
    assert path.read_bytes() == b"frames"
    with pytest.raises(KeyError), atomic_path(path) as part:
        part.write_bytes(b"half")
        raise KeyError
    assert path.read_bytes() == b"frames"
    assert list(tmp_path.iterdir()) == [path]
