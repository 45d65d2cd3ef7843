"""Writing MCAP: header, schemas, channels, chunks with checksum, summary.

Only what a log needs is written: no compression, one index entry per chunk. Any reader
of the format understands it. (The `mcap` package would bring 31 MB of compressors to a
robot that has no use for them.)
"""

import struct
import zlib
from collections.abc import Mapping
from typing import BinaryIO

MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE = 0x01, 0x02, 0x03, 0x04, 0x05
CHUNK, MESSAGE_INDEX, CHUNK_INDEX = 0x06, 0x07, 0x08
STATISTICS, METADATA, METADATA_INDEX, DATA_END = 0x0B, 0x0C, 0x0D, 0x0F


_INDEX_BYTES = 16  # of a message


def text(value: str) -> bytes:
    """A string with its length in front."""
    data = value.encode("utf-8")
    return struct.pack("<I", len(data)) + data


def table(entries: Mapping[str, str]) -> bytes:
    """A map from string to string with its length in bytes in front."""
    data = b"".join(text(key) + text(value) for key, value in entries.items())
    return struct.pack("<I", len(data)) + data


class McapWriter:
    """Writes one file.

    Args:
        file: an empty file, open for binary writing.
        profile: profile of the file, "ros2" for CDR messages.
        library: name of the writer.
    """

    def __init__(self, file: BinaryIO, profile: str, library: str):
        self._file = file
        self._offset = 0
        self._schemas: list[bytes] = []
        self._channels: list[bytes] = []
        self._counts: dict[int, int] = {}
        self._chunk: list[bytes] = []
        self._chunk_index: dict[int, list[tuple[int, int]]] = {}
        self._chunk_size = 0
        self._times: list[int] = []
        self._range: list[int] = []
        self._chunks: list[bytes] = []
        self._metadata: list[bytes] = []
        self._write(MAGIC)
        self._record(HEADER, text(profile) + text(library))

    @property
    def size(self) -> int:
        """Bytes written so far, with those of the chunk that waits and of its index."""
        return self._offset + self._chunk_size + _INDEX_BYTES * len(self._times)

    def add_channel(
        self,
        topic: str,
        schema_name: str,
        schema: str,
        metadata: Mapping[str, str] | None = None,
    ) -> int:
        """Declares a channel of CDR messages; returns its identifier."""
        number = len(self._channels) + 1
        data = schema.encode("utf-8")
        body = struct.pack("<H", number) + text(schema_name) + text("ros2msg")
        self._schemas.append(body + struct.pack("<I", len(data)) + data)
        body = struct.pack("<HH", number, number) + text(topic) + text("cdr")
        self._channels.append(body + table(metadata or {}))
        self._record(SCHEMA, self._schemas[-1])
        self._record(CHANNEL, self._channels[-1])
        self._counts[number] = 0
        return number

    def add_message(self, channel: int, time_ns: int, data: bytes) -> None:
        """Adds a message to the chunk; `flush` writes it."""
        count = self._counts[channel]
        head = struct.pack("<HIQQ", channel, count, time_ns, time_ns)
        entry = (time_ns, self._chunk_size)
        record = struct.pack("<BQ", MESSAGE, len(head) + len(data)) + head + data
        self._chunk_index.setdefault(channel, []).append(entry)
        self._chunk.append(record)
        self._chunk_size += len(record)
        self._times.append(time_ns)
        self._counts[channel] += 1

    def add_metadata(self, name: str, entries: Mapping[str, str]) -> None:
        """Writes a record of named texts."""
        start = self._offset
        self._record(METADATA, text(name) + table(entries))
        length = self._offset - start
        self._metadata.append(struct.pack("<QQ", start, length) + text(name))

    def flush(self) -> None:
        """Writes the chunk and its index to the file."""
        if not self._chunk:
            return
        records = b"".join(self._chunk)
        first, last = min(self._times), max(self._times)
        size, crc = len(records), zlib.crc32(records)
        head = struct.pack("<QQQI", first, last, size, crc) + text("")
        start = self._offset
        self._record(CHUNK, head + struct.pack("<Q", size) + records)
        length = self._offset - start
        index_start, offsets = self._offset, b""
        for channel, entries in self._chunk_index.items():
            offsets += struct.pack("<HQ", channel, self._offset)
            body = b"".join(struct.pack("<QQ", *entry) for entry in entries)
            self._record(MESSAGE_INDEX, struct.pack("<HI", channel, len(body)) + body)
        body = struct.pack("<QQQQI", first, last, start, length, len(offsets)) + offsets
        body += struct.pack("<Q", self._offset - index_start) + text("")
        self._chunks.append(body + struct.pack("<QQ", size, size))
        self._range += [first, last]
        self._range = [min(self._range), max(self._range)]
        self._chunk, self._chunk_index, self._times = [], {}, []
        self._chunk_size = 0
        self._file.flush()

    def close(self) -> None:
        """Writes the summary and closes the file."""
        self.flush()
        self._record(DATA_END, struct.pack("<I", 0))
        start, summary = self._offset, b""
        for kind, bodies in (
            (SCHEMA, self._schemas),
            (CHANNEL, self._channels),
            (STATISTICS, [self._statistics()]),
            (CHUNK_INDEX, self._chunks),
            (METADATA_INDEX, self._metadata),
        ):
            for body in bodies:
                summary += struct.pack("<BQ", kind, len(body)) + body
        self._write(summary)
        self._record(FOOTER, struct.pack("<QQI", start, 0, 0))
        self._write(MAGIC)
        self._file.close()

    def _statistics(self) -> bytes:
        first, last = self._range or (0, 0)
        body = struct.pack(
            "<QHIIIIQQ",
            sum(self._counts.values()),
            len(self._schemas),
            len(self._channels),
            0,
            len(self._metadata),
            len(self._chunks),
            first,
            last,
        )
        counts = b"".join(struct.pack("<HQ", *item) for item in self._counts.items())
        return body + struct.pack("<I", len(counts)) + counts

    def _record(self, kind: int, body: bytes) -> None:
        self._write(struct.pack("<BQ", kind, len(body)) + body)

    def _write(self, data: bytes) -> None:
        self._file.write(data)
        self._offset += len(data)
