"""Commands whose reader ends first, as after `| head`."""

import os
import subprocess
import sys

import pytest

from fingers_mjx.cli.main import NO_READER

FINGERS = (sys.executable, "-m", "fingers_mjx.cli.main")


@pytest.mark.parametrize("unbuffered", ["", "1"])
@pytest.mark.parametrize("words", [("tasks",), ("train", "crawl", "--help")])
def test_a_reader_that_is_gone_is_a_quiet_end(words, unbuffered):
    reader, writer = os.pipe()
    os.close(reader)
    environment = {**os.environ, "PYTHONUNBUFFERED": unbuffered}
    try:
        done = subprocess.run(
            [*FINGERS, *words],
            stdout=writer,
            stderr=subprocess.PIPE,
            env=environment,
            text=True,
            check=False,
        )
    finally:
        os.close(writer)
    assert done.stderr == ""
    assert done.returncode in (0, NO_READER)


def test_what_is_read_ends_as_ever():
    done = subprocess.run([*FINGERS, "tasks"], capture_output=True, check=False)
    assert (done.returncode, done.stderr) == (0, b"")
    assert b"crawl" in done.stdout
