"""Notices to systemd, where it has started the run."""

import socket


def notify(path: str, message: str) -> None:
    """Notifies systemd over its socket; does nothing if nobody listens."""
    address = "\0" + path[1:] if path.startswith("@") else path
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as end:
        end.setblocking(False)
        try:
            end.sendto(message.encode("ascii"), address)
        except OSError:
            return
