"""Runs shape annotations as checks, and watches the interpreter (X1, X3)."""

import gc
import os
import sys
from pathlib import Path

import jax
import jaxtyping
import pytest
from jaxtyping import config, install_import_hook
from support import shapes

from envs.config.xla_flags import add_flags
from envs.rounding import fix_rounding

fix_rounding()  # as the commands do

# Before any test imports them: every array is checked against its annotation.
CHECKER = f"{shapes.__name__}.{shapes.check_arrays.__name__}"
SHAPED = ["rewards", "envs", "sysid"]
jaxtyping.jaxtyped = shapes.of_arrays(jaxtyping.jaxtyped)
install_import_hook(SHAPED, CHECKER)

QUICK_COMPILE = (
    "--xla_backend_optimization_level=0",
    "--xla_cpu_use_fusion_emitters=false",
)
"""Flags of XLA with which a step of an environment is compiled in less than half of the
time; most tests compile more than they compute."""

NETWORK = ("socket.connect", "socket.sendto", "socket.bind", "socket.getaddrinfo")
UNSAFE = ("pickle.find_class", "os.system")
LOOPBACK = ("127.0.0.1", "::1", "localhost", "")


def pytest_addoption(parser):
    """Adds the two ways of compiling of `make test`."""
    words = "compile loops over time as the command that diagnoses does"
    parser.addoption("--whole-loops", action="store_true", help=words)
    words = "compile quickly, to programs that are slower and may round otherwise"
    parser.addoption("--quick-compile", action="store_true", help=words)


def pytest_configure(config):
    """Asks for a way of compiling before anything is computed; also in workers."""
    if config.getoption("--quick-compile"):
        add_flags(os.environ, QUICK_COMPILE)
    if config.getoption("--whole-loops"):
        # Not before the hook above: what it imports is checked, too.
        from sysid.diagnosis.whole_loops import compile_loops_whole

        compile_loops_whole()


MAPS = Path("/proc/self/maps")
MOST_MAPS = 25_000
"""Mapped regions with which a process begins a file of tests: every compiled program
has dozens, and where Linux has no more, after 65,530, the next program is a
segmentation fault."""


class Watch:
    """Events of the interpreter that nothing of ours may cause.

    Attributes:
        network: attempts to reach another machine, of this process.
        unsafe: ways of loading that can run code, while `loading` is set.
    """

    def __init__(self):
        self.network, self.unsafe, self.loading = [], [], False

    def hook(self, event, args):
        if event in NETWORK and leaves_the_machine(event, args):
            self.network.append((event, str(args[-1])))
        elif self.loading and (event in UNSAFE or is_shell(event, args)):
            self.unsafe.append((event, str(args)))


def leaves_the_machine(event, args):
    address = args[0] if event == "socket.getaddrinfo" else args[1]
    host = address[0] if isinstance(address, tuple) else address
    unix = event != "socket.getaddrinfo" and not isinstance(address, tuple)
    return not unix and host not in LOOPBACK


def is_shell(event, args):
    words = args[1] if event == "subprocess.Popen" else []
    return [str(word) for word in words[:2]] in (["/bin/sh", "-c"], ["sh", "-c"])


WATCH = Watch()
sys.addaudithook(WATCH.hook)


@pytest.fixture(autouse=True)
def shapes_are_checked(request):
    """Checks arrays where a package tests itself; elsewhere it would only take time."""
    rooms = request.path.relative_to(Path(__file__).parent).parts
    config.update("jaxtyping_disable", rooms[0] not in SHAPED)


@pytest.fixture(autouse=True, scope="module")
def room_for_programs():
    """Forgets the programs of the files before, where they have become too many."""
    if MAPS.exists() and len(MAPS.read_bytes().splitlines()) > MOST_MAPS:
        jax.clear_caches()
        gc.collect()


@pytest.fixture(autouse=True)
def no_network():
    """Fails the test in which something tried to reach another machine."""
    WATCH.network.clear()
    yield
    assert WATCH.network == []


@pytest.fixture
def every_backend(monkeypatch):
    """A machine on which all physics backends are installed, as a sweep sees it."""
    place = "fingers_mjx.studies.sweep.check.find_spec"
    monkeypatch.setattr(place, lambda name: name)


@pytest.fixture
def watch():
    """The watch, with an eye on unsafe loading for the length of a test."""
    WATCH.unsafe.clear()
    WATCH.loading = True
    yield WATCH
    WATCH.loading = False
