"""What happens to a file: by disks, editors, other programs, and on purpose."""

import os
import socket
from collections.abc import Callable
from pathlib import Path

import numpy as np

Rng = np.random.Generator
Damage = Callable[[Path, bytes, Rng], object]
"""Puts something bad in the place of a path; gets the bytes of a sound file."""

ODD = (
    "nan",
    "-1",
    "1e999",
    "1_0",
    "١",
    "",
    "{}",
    "[[]]",
    "null",
    "'\\ud800'",
    "9" * 400,
)
LARGE = (2**31, 2**40)


def _fifo(path: Path, data: bytes, rng: Rng) -> None:
    os.mkfifo(path)


def _linked(target: str) -> Damage:
    return lambda path, data, rng: path.symlink_to(target)


def _linked_fifo(path: Path, data: bytes, rng: Rng) -> None:
    pipe = path.with_name(f"{path.name}.pipe")
    os.mkfifo(pipe)
    path.symlink_to(pipe)


def _socket(path: Path, data: bytes, rng: Rng) -> None:
    here = os.getcwd()
    with socket.socket(socket.AF_UNIX) as end:
        os.chdir(path.parent)  # names of sockets are short
        end.bind(path.name)
        os.chdir(here)


def _folder(path: Path, data: bytes, rng: Rng) -> None:
    path.mkdir()


def _missing(path: Path, data: bytes, rng: Rng) -> None:
    """Nothing is there."""


def _large(path: Path, data: bytes, rng: Rng) -> None:
    with path.open("wb") as file:
        file.write(data)
        file.truncate(int(rng.choice(LARGE)))


def _noise(path: Path, data: bytes, rng: Rng) -> None:
    path.write_bytes(b"\xff" + rng.bytes(int(rng.integers(1, 5000))))


def _same(piece: bytes, most: int) -> Damage:
    """One thing, again and again."""

    def write(path: Path, data: bytes, rng: Rng) -> None:
        path.write_bytes(piece * int(rng.integers(most // 2, most)))

    return write


def _nested(opened: bytes, closed: bytes) -> Damage:
    def write(path: Path, data: bytes, rng: Rng) -> None:
        depth = int(rng.choice([40, 900, 1000, 100_000]))
        path.write_bytes(opened * depth + closed * depth)

    return write


def _keys(path: Path, data: bytes, rng: Rng) -> None:
    count = int(rng.choice([20_000, 200_000]))
    path.write_bytes(b"{" + b",".join(b'"k%d":0' % k for k in range(count)) + b"}")


def _columns(path: Path, data: bytes, rng: Rng) -> None:
    names = b",".join(b"c%d" % k for k in range(100_000))
    path.write_bytes(b"# schema: 1\nt," + names + b"\n" + b"0," * 100_000 + b"0\n")


HARD: dict[str, Damage] = {
    "missing": _missing,
    "named pipe": _fifo,
    "link to a named pipe": _linked_fifo,
    "link to /dev/zero": _linked("/dev/zero"),
    "link to /dev/random": _linked("/dev/random"),
    "link to itself": lambda path, data, rng: path.symlink_to(path),
    "socket": _socket,
    "folder": _folder,
    "far too large": _large,
    "random bytes": _noise,
    "zeros": _same(b"\0", 1_000_000),
    "commas": _same(b",", 20_000_000),
    "open brackets": _same(b"[", 1_000_000),
    "nested lists": _nested(b"[", b"]"),
    "nested objects": _nested(b'{"a":', b"}"),
    "nested XML": _nested(b"<a>", b"</a>"),
    "many keys": _keys,
    "many columns": _columns,
    "one long line": _same(b"a", 10_000_000),
    "colons": _same(b"? a\n: ", 250_000),
}
"""After these no file of ours is sound."""


def _written(change: Callable[[bytes, Rng], bytes]) -> Damage:
    return lambda path, data, rng: path.write_bytes(change(data, rng))


def _cut(data: bytes, rng: Rng) -> bytes:
    return data[: int(rng.integers(0, len(data)))]


def _flipped(data: bytes, rng: Rng) -> bytes:
    changed = bytearray(data)
    for place in rng.integers(0, len(data), int(rng.integers(1, 4))):
        changed[place] ^= 1 << int(rng.integers(8))
    return bytes(changed)


def _inserted(data: bytes, rng: Rng) -> bytes:
    place = int(rng.integers(len(data)))
    return data[:place] + rng.bytes(int(rng.integers(1, 40))) + data[place:]


def _odd_number(data: bytes, rng: Rng) -> bytes:
    """Puts an odd text in the place of a number."""
    starts = [
        i for i in range(1, len(data)) if _digit(data, i) and data[i - 1] in b" ,:["
    ]
    if not starts:
        return _inserted(data, rng)
    start = end = starts[int(rng.integers(len(starts)))]
    while end < len(data) and data[end] in b"0123456789.e-":
        end += 1
    return data[:start] + str(rng.choice(ODD)).encode() + data[end:]


def _digit(data: bytes, place: int) -> bool:
    return data[place] in b"0123456789"


def _line_gone(data: bytes, rng: Rng) -> bytes:
    lines = data.splitlines(keepends=True)
    del lines[int(rng.integers(len(lines)))]
    return b"".join(lines)


def _line_twice(data: bytes, rng: Rng) -> bytes:
    lines = data.splitlines(keepends=True)
    place = int(rng.integers(len(lines)))
    return b"".join([*lines[:place], lines[place], *lines[place:]])


def _recoded(name: str) -> Callable[[bytes, Rng], bytes]:
    return lambda data, rng: data.decode("latin-1").encode(name, "replace")


SOFT: dict[str, Damage] = {
    "cut": _written(_cut),
    "flipped bits": _written(_flipped),
    "inserted bytes": _written(_inserted),
    "odd number": _written(_odd_number),
    "line gone": _written(_line_gone),
    "line twice": _written(_line_twice),
    "UTF-16": _written(_recoded("utf-16")),
    "UTF-32": _written(_recoded("utf-32")),
    "byte order mark": _written(lambda data, rng: b"\xef\xbb\xbf" + data),
    "Latin-1": _written(lambda data, rng: b"\xe9" + data),
}
"""After these a file may still say something that is sound."""
