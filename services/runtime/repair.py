"""Checks logs, and mends those whose writer was killed."""

from collections import Counter
from pathlib import Path
from typing import Any

from mcap.records import Attachment, Channel, Header, Message, Metadata, Schema
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer

from schemas.codec import MalformedMessageError, decode
from schemas.topics import ALL_TOPICS
from services.runtime.log_file import UNREADABLE, LogError, LogRecord, is_mcap, opened, read_log


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
        LogError: no such file, or nothing in it can be read; no file is left then.
    """
    copier = _Copier()
    with opened(path) as stream, target.open("wb") as out:
        writer = Writer(out, compression=CompressionType.ZSTD)
        try:
            for record in StreamReader(stream, validate_crcs=True).records:
                copier.copy(record, writer)
        except UNREADABLE as error:
            copier.ended_by = error
        if copier.messages:
            writer.finish()
            return copier.messages
    target.unlink()
    why = str(copier.ended_by or "it holds no message") if is_mcap(path) else "not an MCAP file"
    raise LogError(f"{path}: nothing could be recovered: {why}")


class _Copier:
    """Copies records between files; schema and channel numbers are given anew."""

    def __init__(self) -> None:
        self.messages = 0
        self.ended_by: Exception | None = None
        self._schemas: dict[int, int] = {}
        self._channels: dict[int, int] = {}

    def copy(self, record: Any, writer: Writer) -> None:
        match record:
            case Header():
                writer.start(profile=record.profile, library="incognita recover")
            case Schema() if record.id not in self._schemas:
                self._schemas[record.id] = writer.register_schema(
                    record.name, record.encoding, record.data
                )
            case Channel() if record.id not in self._channels:
                self._channels[record.id] = writer.register_channel(
                    record.topic,
                    record.message_encoding,
                    self._schemas.get(record.schema_id, 0),
                    record.metadata,
                )
            case Message():
                self.messages += 1
                writer.add_message(
                    self._channels[record.channel_id],
                    record.log_time,
                    record.data,
                    record.publish_time,
                    record.sequence,
                )
            case Metadata():
                writer.add_metadata(record.name, record.metadata)
            case Attachment():
                writer.add_attachment(
                    record.create_time,
                    record.log_time,
                    record.name,
                    record.media_type,
                    record.data,
                )
            case _:
                pass
