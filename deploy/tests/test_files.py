"""Every reader opens what a user names in the same way: regular files, of some size."""

import os
import time

import pytest

from fingers_deploy.bundle import MANIFEST_FILE, POLICY_FILE, load_bundle
from fingers_deploy.errors import InputError, shortened
from fingers_deploy.files import is_folder, open_regular, read_regular
from fingers_deploy.strict_json import MAX_JSON_BYTES, load_json
from fingers_robot.behaviour.plan import read_plan
from fingers_robot.record import read_log
from fingers_robot.simulator.hand import load_model

READERS = {
    "bundle": lambda path, interface: load_bundle(path),
    "plan": read_plan,
    "log": lambda path, interface: read_log(path),
    "model": lambda path, interface: load_model(path),
}


def test_a_file_of_the_kernel_that_would_wait_is_special(tmp_path, monkeypatch):
    """As /proc/kmsg with nothing to say: it calls itself regular, reading waits."""
    path = tmp_path / "kmsg"
    path.write_bytes(b"text")
    assert read_regular(path, 100) == b"text"

    def waits(*_):
        raise BlockingIOError

    monkeypatch.setattr(os, "pread", waits)
    with pytest.raises(InputError, match="found a special file"):
        read_regular(path, 100)


@pytest.fixture(params=["pipe", "link to a pipe", "/dev/zero", "link to /dev/zero"])
def special(request, tmp_path):
    pipe, link = tmp_path / "pipe", tmp_path / "link"
    os.mkfifo(pipe)
    target = pipe if "pipe" in request.param else "/dev/zero"
    link.symlink_to(target)
    return str(link if request.param.startswith("link") else target)


@pytest.mark.parametrize("reader", READERS)
def test_a_special_file_is_refused_at_once(reader, special, interface):
    begin = time.monotonic()
    with pytest.raises(InputError, match=r"found a (named pipe|device); valid: a reg"):
        READERS[reader](special, interface)
    assert time.monotonic() - begin < 30  # it would wait for ever


@pytest.mark.parametrize("reader", READERS)
def test_a_file_that_is_too_large_is_refused_before_it_is_read(
    reader, tmp_path, interface
):
    path = tmp_path / "large"
    with path.open("wb") as file:
        file.truncate(2**40)  # it takes no room on the disk
    with pytest.raises(InputError, match=f"found {2**40} bytes.* of at most"):
        READERS[reader](path, interface)


@pytest.mark.parametrize("path", ["n" * 5000, "\udc80", "a\0b", "x/../" * 3000])
@pytest.mark.parametrize("reader", READERS)
def test_what_is_no_path_is_one_sentence(reader, path, interface):
    with pytest.raises(InputError) as found:
        READERS[reader](path, interface)
    assert len(str(found.value)) <= 300 and str(found.value).isprintable()


def test_a_pipe_in_the_place_of_a_bundles_file_is_refused(bundle_dir):
    for name in (MANIFEST_FILE, POLICY_FILE):
        (bundle_dir / name).unlink()
        os.mkfifo(bundle_dir / name)
        with pytest.raises(InputError, match="named pipe"):
            load_bundle(bundle_dir)


def test_a_manifest_of_a_million_keys_is_refused_before_it_is_parsed(bundle_dir):
    keys = ",".join(f'"{k}":0' for k in range(300_000))
    (bundle_dir / MANIFEST_FILE).write_text("{" + keys + "}")
    with pytest.raises(InputError, match="at most 1 MiB"):
        load_bundle(bundle_dir)
    with pytest.raises(InputError, match=str(MAX_JSON_BYTES)):
        load_json("{" + keys + "}", "manifest")


def test_a_repeated_key_is_found_without_comparing_all_with_all():
    keys = ",".join(f'"{k}":0' for k in range(60_000))
    begin = time.process_time()
    with pytest.raises(InputError, match="'59999' is repeated"):
        load_json("{" + keys + ',"59999":1}', "manifest")
    assert time.process_time() - begin < 10  # it took minutes


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("t," + ",".join("cmd.a" for _ in range(100_000)) + "\n0\n1\n", "columns"),
        ("t\n" + "," * 2_000_001, "cells"),
        ("t,cmd.a\n" + "\n" * 10, "cells"),
    ],
)
def test_a_plan_of_too_many_cells_is_refused(tmp_path, interface, text, words):
    path = tmp_path / "plan.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=words):
        read_plan(path, interface)


def test_a_regular_file_is_read_whole_and_through_a_link(tmp_path):
    path, link = tmp_path / "file", tmp_path / "link"
    path.write_bytes(b"abc")
    link.symlink_to(path)
    assert read_regular(link, 3) == b"abc"
    with open_regular(path, 3) as file:
        assert file.read() == b"abc"
    with pytest.raises(InputError, match="3 bytes"):
        read_regular(path, 2)
    assert is_folder(tmp_path) and not is_folder(path)


@pytest.mark.parametrize(
    "value", ["a" * 5000, "\n\t b " * 900, "\x1b[31m" * 80, "é" * 99]
)
def test_what_is_found_is_shortened_in_one_place(value):
    assert len(shortened(value)) <= 80 and shortened(value).isprintable()
    sentence = str(InputError(value, value, value, value))
    assert len(sentence) <= 300 and sentence.isprintable()


def test_both_ends_of_what_is_shortened_stay():
    text = "/home/somebody/" + "deep/" * 50 + "hand.yaml"
    assert shortened(text).startswith("/home/somebody/deep")
    assert shortened(text).endswith("deep/hand.yaml")
    assert shortened("short") == "short" and shortened("") == "nothing"
