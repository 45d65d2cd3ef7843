"""Taking what waits at a socket or device, without ever waiting for it."""

from collections.abc import Callable, Iterator

EVERY = 1 << 30


def waiting(
    receive: Callable[[int], bytes], size: int, most: int = EVERY
) -> Iterator[bytes]:
    """Yields the packets that wait now, oldest first; at last b"" if the end is gone.

    Args:
        receive: takes one packet of at most so many bytes; does not block.
        size: longest packet [bytes].
        most: how many are taken at once.
    """
    for _ in range(most):
        try:
            data = receive(size)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        yield data
        if not data:
            return
