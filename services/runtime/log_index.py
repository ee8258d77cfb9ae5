"""Reads the index of a log quickly: a file of a gigabyte has thousands of chunks."""

import io
import struct
from typing import IO, cast

import numpy as np
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.reader import FOOTER_SIZE, SeekingReader
from mcap.records import (
    AttachmentIndex,
    Channel,
    ChunkIndex,
    Footer,
    MetadataIndex,
    Schema,
    Statistics,
)
from mcap.stream_reader import MAGIC_SIZE, StreamReader
from mcap.summary import Summary

_record = struct.Struct("<BQ")
_chunk = struct.Struct("<QQQQI")
_after_offsets = struct.Struct("<QI")
_sizes = struct.Struct("<QQ")
_offset = np.dtype([("channel", "<u2"), ("offset", "<u8")])


class IndexedReader(SeekingReader):
    """The package's reader; it reads field by field what is read here at a stroke.

    Args:
        stream: the file.
        by_topic: read which topics each chunk holds, too; without it chunks hold any of them.
    """

    def __init__(self, stream: IO[bytes], *, by_topic: bool) -> None:
        super().__init__(stream, validate_crcs=True)
        self._by_topic = by_topic

    def get_summary(self) -> Summary | None:
        """The index, or None in a file without one."""
        if self._summary is None:
            self._summary = self._read_summary()
        return self._summary

    def _read_summary(self) -> Summary | None:
        self._stream.seek(-(FOOTER_SIZE + MAGIC_SIZE), io.SEEK_END)
        end = self._stream.read()
        footer = next(StreamReader(io.BytesIO(end), skip_magic=True).records)
        if not isinstance(footer, Footer):
            raise McapError("no footer at the end of the file")
        if footer.summary_start == 0:
            return None
        self._stream.seek(footer.summary_start)
        return _summary(self._stream.read(), self._by_topic)


def _summary(data: bytes, by_topic: bool) -> Summary:
    """The records of the summary section, to the end of the file."""
    summary, others, at = Summary(), bytearray(), 0
    while at + _record.size <= len(data) - MAGIC_SIZE:
        code, size = _record.unpack_from(data, at)
        body = at + _record.size
        if code == Opcode.CHUNK_INDEX:
            summary.chunk_indexes.append(_chunk_index(data, body, by_topic))
        else:
            others += data[at : body + size]
        at = body + size
    _take_others(summary, bytes(others) + data[-MAGIC_SIZE:])
    return summary


def _chunk_index(data: bytes, at: int, by_topic: bool) -> ChunkIndex:
    first_ns, last_ns, start, length, size = _chunk.unpack_from(data, at)
    at += _chunk.size
    by_channel = _offsets(data, at, size) if by_topic else {}
    index_length, name_size = _after_offsets.unpack_from(data, at + size)
    at += size + _after_offsets.size
    compressed, uncompressed = _sizes.unpack_from(data, at + name_size)
    return ChunkIndex(
        message_start_time=first_ns,
        message_end_time=last_ns,
        chunk_start_offset=start,
        chunk_length=length,
        message_index_offsets=by_channel,
        message_index_length=index_length,
        compression=data[at : at + name_size].decode(),
        compressed_size=compressed,
        uncompressed_size=uncompressed,
    )


def _offsets(data: bytes, at: int, size: int) -> dict[int, int]:
    offsets = np.frombuffer(data, _offset, size // _offset.itemsize, at)
    # A dict of a list of pairs is the fastest way out of an array.
    return dict(cast(list[tuple[int, int]], offsets.tolist()))


def _take_others(summary: Summary, data: bytes) -> None:
    for record in StreamReader(io.BytesIO(data), skip_magic=True).records:
        match record:
            case Statistics():
                summary.statistics = record
            case Schema():
                summary.schemas[record.id] = record
            case Channel():
                summary.channels[record.id] = record
            case AttachmentIndex():
                summary.attachment_indexes.append(record)
            case MetadataIndex():
                summary.metadata_indexes.append(record)
            case _:
                pass
