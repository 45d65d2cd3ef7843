"""Reading MCAP, as far as our own logs use it; checksums are verified."""

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from fingers_deploy.errors import InputError
from fingers_deploy.files import read_regular
from fingers_robot.record.mcap_write import (
    CHANNEL,
    CHUNK,
    DATA_END,
    HEADER,
    MAGIC,
    MESSAGE,
    MESSAGE_INDEX,
    METADATA,
    SCHEMA,
)

_MAX_BYTES = 64 * 2**20
"""Of a file; the recorder begins a new one before 50 MB."""
_MAX_MESSAGES = 500_000
_MAX_NAMES = 1000
_CHUNK_HEAD = struct.Struct("<QQQI")
_MESSAGE_HEAD = struct.Struct("<HIQQ")


@dataclass
class McapFile:
    """The content of a file.

    Attributes:
        topics: topic of each channel.
        schemas: name of the schema of each channel.
        messages: time [ns] and data of each message, by topic, in the file's order.
        metadata: the metadata records by name.
        complete: the data end as they should; false after a crash of the writer.
        count: number of messages.
        names: number of schemas, channels and metadata records.
    """

    topics: dict[int, str] = field(default_factory=dict)
    schemas: dict[int, str] = field(default_factory=dict)
    messages: dict[str, list[tuple[int, bytes]]] = field(default_factory=dict)
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    complete: bool = False
    count: int = 0
    names: int = 0


def read_mcap(path: str | Path) -> McapFile:
    """Reads a log.

    A file that was not closed is read up to its last whole chunk, and says so.

    Raises:
        InputError: not such a file, or damaged.
    """
    path = Path(path)
    data = read_regular(path, _MAX_BYTES)
    if data[: len(MAGIC)] != MAGIC:
        raise InputError(path, "", "another kind of file", "an MCAP log")
    found, names = McapFile(), {}
    try:
        for kind, body in _records(data[len(MAGIC) :], found):
            _take(kind, body, found, names, path)
    except (struct.error, UnicodeDecodeError, KeyError, IndexError) as error:
        where = f"a damaged record ({type(error).__name__})"
        raise InputError(path, "", where, "an undamaged MCAP log") from error
    return found


def _records(data: bytes, found: McapFile | None) -> Iterator[tuple[int, bytes]]:
    """Yields the records up to the end of the data section."""
    position = 0
    while position + 9 <= len(data):
        kind, length = struct.unpack_from("<BQ", data, position)
        position += 9
        if position + length > len(data):
            return
        yield kind, data[position : position + length]
        position += length
        if kind == DATA_END:
            if found is not None:
                found.complete = True
            return


def _take(
    kind: int, body: bytes, found: McapFile, names: dict[int, str], path: Path
) -> None:
    found.names += kind in (SCHEMA, CHANNEL, METADATA)
    if found.names > _MAX_NAMES or found.count > _MAX_MESSAGES:
        valid = f"at most {_MAX_MESSAGES} messages and {_MAX_NAMES} names"
        raise InputError(path, "", "more", valid)
    if kind == SCHEMA:
        (number,) = struct.unpack_from("<H", body)
        names[number], _ = _text(body, 2)
    elif kind == CHANNEL:
        number, schema = struct.unpack_from("<HH", body)
        found.topics[number], _ = _text(body, 4)
        found.schemas[number] = names[schema]
        found.messages.setdefault(found.topics[number], [])
    elif kind == METADATA:
        name, position = _text(body, 0)
        found.metadata[name] = _table(body, position)
    elif kind == CHUNK:
        for inner, message in _records(_chunk(body, path), None):
            if inner != MESSAGE:
                raise InputError(path, "", f"record {inner} in a chunk", "messages")
            found.count += 1
            number, _, time_ns, _ = _MESSAGE_HEAD.unpack_from(message)
            data = message[_MESSAGE_HEAD.size :]
            found.messages[found.topics[number]].append((time_ns, data))
    elif kind not in (HEADER, DATA_END, MESSAGE_INDEX):
        raise InputError(path, "", f"a record of kind {kind}", "a log of this package")


def _chunk(body: bytes, path: Path) -> bytes:
    _, _, size, crc = _CHUNK_HEAD.unpack_from(body)
    compression, position = _text(body, _CHUNK_HEAD.size)
    if compression:
        raise InputError(path, "chunk", f"{compression} compression", "none")
    records = body[position + 8 :]
    if len(records) != size or zlib.crc32(records) != crc:
        raise InputError(path, "chunk", "a wrong checksum", "an undamaged MCAP log")
    return records


def _text(data: bytes, position: int) -> tuple[str, int]:
    (length,) = struct.unpack_from("<I", data, position)
    end = position + 4 + length
    if end > len(data):
        raise IndexError("a text ends behind its record")
    return data[position + 4 : end].decode("utf-8"), end


def _table(data: bytes, position: int) -> dict[str, str]:
    (length,) = struct.unpack_from("<I", data, position)
    position, end, entries = position + 4, position + 4 + length, {}
    while position < end:
        key, position = _text(data, position)
        entries[key], position = _text(data, position)
    return entries
