"""X9: what the robot's service may do, and what its processes have open."""

import configparser
import contextlib
import os
import signal
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from fingers_robot.runtime.launcher import LAST_S

UNITS = Path(__file__).parents[1] / "systemd"


def unit(name):
    parser = configparser.ConfigParser(strict=False, interpolation=None)
    parser.optionxform = str
    parser.read(UNITS / name)
    return parser


def test_the_service_runs_as_an_ordinary_user_with_one_capability():
    service = unit("fingers-deploy.service")["Service"]
    assert service["User"] not in ("root", "0")
    for field in ("AmbientCapabilities", "CapabilityBoundingSet"):
        assert service[field] == "CAP_SYS_NICE"


def test_it_is_watched_de_energizes_at_its_end_and_starts_by_hand_only():
    service = unit("fingers-deploy.service")
    assert service["Service"]["Type"] == "notify"
    assert service["Service"]["WatchdogSec"] == "1"
    assert service["Service"]["Restart"] == "no"
    assert "guard" in service["Service"]["ExecStopPost"]
    assert "--arm" not in service["Service"]["ExecStart"]
    assert service["Service"]["KillMode"] == "mixed"
    assert service["Service"]["NotifyAccess"] == "all"  # the notices are the guard's
    assert service["Service"]["WatchdogSignal"] == "SIGKILL"  # it reaches what stands
    assert float(service["Service"]["TimeoutStopSec"]) > LAST_S
    assert "Install" not in service and "Install" not in unit("fingers-deploy.socket")


def test_hand_and_console_are_not_open_to_everybody():
    rules = (UNITS / "99-wuji-hand.rules").read_text()
    assert 'MODE="0660"' in rules and "0666" not in rules
    console = unit("fingers-deploy.socket")["Socket"]
    assert console["SocketMode"] == "0600"
    assert not any(key.startswith("Listen") and key != "ListenFIFO" for key in console)


@pytest.fixture
def service(hand_model, marching_dir, tmp_path):
    """A run whose console is a named pipe, as in the unit; in a group of its own."""
    path = tmp_path / "console"
    os.mkfifo(path)
    pipe = os.open(path, os.O_RDWR)
    program = [sys.executable, "-m", "fingers_robot", "run", str(marching_dir)]
    program += ["--driver", "sim", "--model", str(hand_model), "--no-record"]
    process = subprocess.Popen(
        [*program, "--wiggle", "none"],
        stdin=pipe,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )
    yield pipe, process
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGKILL)
    process.communicate()
    os.close(pipe)


@pytest.fixture
def manager(tmp_path, monkeypatch):
    """The socket of a service manager, that the run notifies."""
    path = tmp_path / "notify"
    monkeypatch.setenv("NOTIFY_SOCKET", str(path))
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as end:
        end.bind(str(path))
        end.settimeout(30.0)
        yield end


def wait_for(process, words):
    """Reads what the run says until `words` are in it."""
    said = []
    for line in process.stdout:
        said.append(line)
        if words in line:
            return
    raise AssertionError("".join(said))


def arm(pipe, process):
    """Asks to arm until it is taken: refused until the policy's process answers."""
    wait_for(process, "type: arm")
    refused = True
    while refused:
        os.write(pipe, b"arm\n")
        line = process.stdout.readline()
        assert line, process.poll()
        refused = "disabled -> arming" not in line
    wait_for(process, "arming -> active")


def network_sockets(group):
    """Sockets that any process of the group has open on a network."""
    listed = set()
    for table in ("tcp", "tcp6", "udp", "udp6", "raw", "packet"):
        path = Path("/proc/net") / table
        rows = path.read_text().splitlines()[1:] if path.exists() else []
        listed |= {word for row in rows for word in row.split()[8:10]}
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):  # it has ended meanwhile
            if os.getpgid(int(process.name)) == group:
                found += [inode for inode in sockets(process) if inode in listed]
    return found


def sockets(process):
    """Inodes of the sockets that a process has open."""
    inodes = []
    for link in (process / "fd").iterdir():
        with contextlib.suppress(OSError):  # closed meanwhile
            name = os.readlink(link)
            inodes += [name[8:-1]] if name.startswith("socket:[") else []
    return inodes


def test_a_run_typed_at_through_a_pipe_has_nothing_open_on_a_network(service):
    pipe, process = service
    arm(pipe, process)
    assert network_sockets(process.pid) == []
    os.write(pipe, b"quit\n")
    wait_for(process, "de-energized, confirmed")
    assert process.wait() in (0, 5)


def test_a_request_to_end_that_reaches_every_process_settles_the_hand(service):
    """As a service manager sends it, at the end of a run or of the computer."""
    pipe, process = service
    arm(pipe, process)
    os.killpg(process.pid, signal.SIGTERM)
    wait_for(process, "OP operator stop: asked for -> settle")
    wait_for(process, "de-energized, confirmed by the hand")
    assert process.wait() in (0, 5)


def test_the_manager_waits_for_the_guard(manager, service):
    """At the end no status comes any more: the watchdog of one second is prolonged."""
    pipe, process = service
    assert manager.recv(100) == b"READY=1\nWATCHDOG=1"
    os.write(pipe, b"quit\n")
    while b"WATCHDOG_USEC" not in (message := manager.recv(100)):
        assert message == b"READY=1\nWATCHDOG=1"
    assert message == b"WATCHDOG_USEC=%d\nWATCHDOG=1" % round(1e6 * LAST_S)
    assert process.wait() == 0


def test_a_socket_on_a_network_would_be_found():
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        listener.listen()
        assert network_sockets(os.getpgrp())
