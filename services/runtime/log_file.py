"""Reads logs: messages in order, and what a file says about itself."""

import struct
from collections import Counter
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

from mcap.exceptions import McapError
from mcap.reader import McapReader
from mcap.records import Statistics
from mcap.summary import Summary
from zstandard import ZstdError

from schemas.codec import MalformedMessageError, decode
from schemas.errors import UserError
from schemas.topics import Topic
from services.runtime.log_index import IndexedReader
from services.runtime.sink import MAGIC

PROFILE = "incognita"
ENCODING = "msgpack"
"""Of our messages. Those of channels in other encodings show them to viewers and play nothing."""
UNREADABLE = (McapError, ZstdError, struct.error, ValueError, EOFError, KeyError)
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


def read_log(path: Path, only: Collection[Topic[Any]] = ()) -> Iterator[LogRecord]:
    """Messages of a log in the order they were logged.

    Args:
        path: file of a run.
        only: topics to read; none is all of them.

    Raises:
        LogError: no such file, a file of another program, or not closed properly.
    """
    with opened(path) as stream:
        try:
            reader, summary = _reader(path, stream, by_topic=bool(only))
            topics = {c.topic for c in summary.channels.values() if c.message_encoding == ENCODING}
            topics = topics & {topic.key for topic in only} if only else topics
            for _, channel, message in reader.iter_messages(topics, log_time_order=True):
                publisher = channel.metadata.get("publisher", "")
                yield LogRecord(
                    channel.topic, publisher, message.log_time, message.sequence, message.data
                )
        except UNREADABLE as error:
            raise unreadable(path, error) from error


def read_messages(
    path: Path, only: Collection[Topic[Any]]
) -> Iterator[tuple[int, Topic[Any], Any]]:
    """Messages of some topics, decoded: when each was logged [ns], its topic, and it.

    Raises:
        LogError: as `read_log`, or a message of another version of the code.
    """
    topics = {topic.key: topic for topic in only}
    for record in read_log(path, only):
        topic = topics[record.topic]
        try:
            yield record.log_ns, topic, decode(record.data, topic.type)
        except MalformedMessageError as error:
            raise LogError(f"{path}: {topic.key}: {error}") from error


def log_summary(path: Path) -> dict[str, Any]:
    """What is in a log: times [ns], message counts by topic, metadata.

    Raises:
        LogError: no such file, a file of another program, or not closed properly.
    """
    with opened(path) as stream:
        try:
            reader, summary = _reader(path, stream)
            metadata = {record.name: record.metadata for record in reader.iter_metadata()}
        except UNREADABLE as error:
            raise unreadable(path, error) from error
    statistics = summary.statistics or _nothing
    size = path.stat().st_size
    span_s = (statistics.message_end_time - statistics.message_start_time) / 1e9
    return {
        "file": str(path),
        "bytes": size,
        "bytes_per_minute": round(60 * size / span_s) if span_s else None,
        "messages": statistics.message_count,
        "start_ns": statistics.message_start_time,
        "end_ns": statistics.message_end_time,
        "topics": _counts(summary, statistics, shown=False),
        "shown": _counts(summary, statistics, shown=True),
        "metadata": metadata,
    }


_nothing = Statistics(
    attachment_count=0,
    channel_count=0,
    channel_message_counts={},
    chunk_count=0,
    message_count=0,
    metadata_count=0,
    message_start_time=0,
    message_end_time=0,
    schema_count=0,
)


def _counts(summary: Summary, statistics: Statistics, *, shown: bool) -> dict[str, int]:
    """Messages by topic: those that were sent, or those that show them to viewers."""
    counts: Counter[str] = Counter()
    for number, count in sorted(statistics.channel_message_counts.items()):
        channel = summary.channels[number]
        if shown == (channel.message_encoding != ENCODING):
            counts[channel.topic] += count
    return dict(counts)


def _reader(path: Path, stream: IO[bytes], *, by_topic: bool = False) -> tuple[McapReader, Summary]:
    reader = IndexedReader(stream, by_topic=by_topic)
    header = reader.get_header()
    if header.profile != PROFILE:
        raise LogError(
            f"{path}: a log of another program (profile {header.profile!r}, written by "
            f"{header.library!r}); allowed: files of 'incognita up', 'record' and 'episode --log'"
        )
    summary = reader.get_summary()
    if summary is None:
        raise LogError(f"{path}: no index; run 'incognita log recover {path}'")
    return reader, summary


def opened(path: Path) -> IO[bytes]:
    """The file, to be read.

    Raises:
        LogError: there is none.
    """
    if not path.is_file():
        raise LogError(f"{path}: no such file")
    return path.open("rb")


def is_mcap(path: Path) -> bool:
    """Whether a file begins as MCAP files do."""
    with path.open("rb") as stream:
        return stream.read(len(MAGIC)) == MAGIC


def _ends_well(path: Path) -> bool:
    with path.open("rb") as stream:
        stream.seek(max(0, path.stat().st_size - len(MAGIC)))
        return stream.read() == MAGIC


def unreadable(path: Path, error: Exception) -> LogError:
    """What to say about a file that the reader gave up."""
    if isinstance(error, LogError):
        return error
    if not is_mcap(path):
        return LogError(f"{path}: not an MCAP file")
    why = f"damaged ({error or type(error).__name__})"
    if not _ends_well(path):
        why = "not complete (its writer was killed, still writes, or it was copied in part)"
    return LogError(f"{path}: {why}; try 'incognita log recover {path}'")
