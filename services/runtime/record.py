"""One MCAP file a run: every message as it was sent, and what is needed to repeat the run.

A killed writer loses at most what came since the last flush. `recover` mends such a file.
"""

import json
import struct
import time
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.records import Attachment, Channel, Message, Metadata, Schema
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer

from schemas.codec import MalformedMessageError, decode
from schemas.errors import UserError
from schemas.topics import ALL_TOPICS
from services.runtime.mailbox import Sample

FLUSH_S = 0.4
_profile = "incognita"
_encoding = "msgpack"
_unreadable_errors = (McapError, struct.error, ValueError, EOFError)
"""What the reader raises on files that are cut short or are something else."""


class LogError(UserError):
    """A file that is not a readable log; the text says what to do."""


@dataclass(frozen=True)
class LogRecord:
    """One message of a log."""

    topic: str
    publisher: str
    """Number of the process that sent it."""
    log_ns: int
    sequence: int
    """Per publisher and topic."""
    data: bytes


class LogWriter:
    """Writes samples. Not thread safe."""

    def __init__(self, path: Path, metadata: Mapping[str, Mapping[str, str]]) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        self.path = path
        self._writer = Writer(str(path), compression=CompressionType.ZSTD)
        self._writer.start(profile=_profile, library="incognita")
        self._channels: dict[tuple[str, int], int] = {}
        for name, fields in metadata.items():
            self._writer.add_metadata(name, dict(fields))
        self._flushed = time.monotonic()

    def write(self, sample: Sample, log_ns: int) -> None:
        """Append one message; `log_ns` is when it was received."""
        self._writer.add_message(
            channel_id=self._channel(sample),
            log_time=log_ns,
            data=sample.payload,
            publish_time=sample.sent_ns,
            sequence=sample.sequence & 0xFFFFFFFF,
        )
        self.flush_if_due()

    def flush_if_due(self) -> None:
        """Hand everything to the operating system, at most every `FLUSH_S`."""
        if time.monotonic() - self._flushed >= FLUSH_S:
            self._writer.flush()
            self._flushed = time.monotonic()

    def close(self) -> None:
        """Write the index and close the file."""
        self._writer.finish()

    def _channel(self, sample: Sample) -> int:
        """One channel a topic and publisher, because each publisher counts for itself."""
        topic, key = sample.topic, (sample.topic.key, sample.publisher)
        if key not in self._channels:
            schema = self._writer.register_schema(
                name=f"incognita.{topic.type.__name__}",
                encoding="jsonschema",
                data=json.dumps(json_schema(topic.type)).encode(),
            )
            self._channels[key] = self._writer.register_channel(
                topic=topic.key,
                message_encoding=_encoding,
                schema_id=schema,
                metadata={"publisher": str(sample.publisher)},
            )
        return self._channels[key]


def json_schema(message_type: type[msgspec.Struct]) -> dict[str, Any]:
    """JSON Schema of a message as `schemas.codec.as_builtins` shows it."""
    (reference,), definitions = msgspec.json.schema_components(
        [message_type], schema_hook=_array_schema, ref_template="#/$defs/{name}"
    )
    name = reference["$ref"].rsplit("/", 1)[1]
    root = definitions.pop(name)
    return {**root, "$defs": definitions} if definitions else root


def _array_schema(kind: type) -> dict[str, Any]:
    if getattr(kind, "__origin__", kind) is np.ndarray:
        return {"type": "array", "description": "type code, dimensions, sizes, raw elements"}
    raise NotImplementedError(f"no JSON schema for {kind}")


def read_log(path: Path) -> Iterator[LogRecord]:
    """Messages of a log in the order they were logged.

    Raises:
        LogError: no such file, or not closed properly (see `recover`).
    """
    with _opened(path) as stream:
        try:
            for _, channel, message in make_reader(stream).iter_messages(log_time_order=True):
                publisher = channel.metadata.get("publisher", "")
                yield LogRecord(
                    channel.topic, publisher, message.log_time, message.sequence, message.data
                )
        except _unreadable_errors as error:
            raise _unreadable(path, error) from error


def log_summary(path: Path) -> dict[str, Any]:
    """What is in a log: times [ns], message counts by topic, metadata.

    Raises:
        LogError: no such file, or not closed properly.
    """
    with _opened(path) as stream:
        try:
            reader = make_reader(stream)
            summary = reader.get_summary()
            metadata = {record.name: record.metadata for record in reader.iter_metadata()}
        except _unreadable_errors as error:
            raise _unreadable(path, error) from error
    if summary is None or summary.statistics is None:
        raise LogError(f"{path}: no summary; run 'incognita log recover {path}'")
    statistics = summary.statistics
    counts: Counter[str] = Counter()
    for channel, count in sorted(statistics.channel_message_counts.items()):
        counts[summary.channels[channel].topic] += count
    return {
        "file": str(path),
        "bytes": path.stat().st_size,
        "messages": statistics.message_count,
        "start_ns": statistics.message_start_time,
        "end_ns": statistics.message_end_time,
        "topics": dict(counts),
        "metadata": metadata,
    }


def check_log(path: Path) -> list[str]:
    """What is wrong with a log, one line each: gaps, messages that do not decode.

    Raises:
        LogError: no such file, or not closed properly.
    """
    checker = _Checker()
    for record in read_log(path):
        checker.check(record)
    return checker.problems()


class _Checker:
    """Counts gaps in the sequence numbers and messages that do not decode, by topic."""

    def __init__(self) -> None:
        self._topics = {topic.key: topic for topic in ALL_TOPICS}
        self._last: dict[tuple[str, str], int] = {}
        self._missing: Counter[str] = Counter()
        self._unreadable: Counter[str] = Counter()

    def check(self, record: LogRecord) -> None:
        stream = (record.topic, record.publisher)
        expected = self._last.get(stream, record.sequence - 1) + 1
        self._missing[record.topic] += max(0, record.sequence - expected)
        self._last[stream] = record.sequence
        topic = self._topics.get(record.topic)
        try:
            if topic is not None:
                decode(record.data, topic.type)
        except MalformedMessageError:
            self._unreadable[record.topic] += 1

    def problems(self) -> list[str]:
        return [
            f"{topic}: {count} messages {what}"
            for counts, what in ((self._missing, "missing"), (self._unreadable, "not readable"))
            for topic, count in counts.items()
            if count
        ]


def recover(path: Path, target: Path) -> int:
    """Copy all that can be read of a broken log into a new, complete one.

    Returns:
        Number of messages recovered.

    Raises:
        LogError: no such file, or nothing in it can be read.
    """
    with _opened(path) as stream, target.open("wb") as out:
        writer = Writer(out, compression=CompressionType.ZSTD)
        copier = _Copier(writer)
        try:
            for record in StreamReader(stream, validate_crcs=True).records:
                copier.copy(record)
        except _unreadable_errors as error:
            copier.ended_by = str(error)
        copier.finish()
    if not copier.messages:
        raise LogError(f"{path}: nothing could be recovered ({copier.ended_by})")
    return copier.messages


class _Copier:
    """Copies records between files; schema and channel numbers are given anew."""

    def __init__(self, writer: Writer) -> None:
        self.messages = 0
        self.ended_by = "end of file"
        self._writer = writer
        self._writer.start(profile=_profile, library="incognita recover")
        self._schemas: dict[int, int] = {}
        self._channels: dict[int, int] = {}

    def copy(self, record: Any) -> None:
        match record:
            case Schema():
                self._schemas.setdefault(
                    record.id,
                    self._writer.register_schema(record.name, record.encoding, record.data),
                )
            case Channel() if record.id not in self._channels:
                self._channels[record.id] = self._writer.register_channel(
                    record.topic,
                    record.message_encoding,
                    self._schemas.get(record.schema_id, 0),
                    record.metadata,
                )
            case Message():
                self.messages += 1
                self._writer.add_message(
                    self._channels[record.channel_id],
                    record.log_time,
                    record.data,
                    record.publish_time,
                    record.sequence,
                )
            case Metadata():
                self._writer.add_metadata(record.name, record.metadata)
            case Attachment():
                self._writer.add_attachment(
                    record.create_time,
                    record.log_time,
                    record.name,
                    record.media_type,
                    record.data,
                )
            case _:
                pass

    def finish(self) -> None:
        self._writer.finish()


def _opened(path: Path) -> Any:
    if not path.is_file():
        raise LogError(f"{path}: no such file")
    return path.open("rb")


def _unreadable(path: Path, error: Exception) -> LogError:
    return LogError(f"{path}: {error or type(error).__name__}; try 'incognita log recover {path}'")
