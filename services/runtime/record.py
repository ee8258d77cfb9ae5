"""One MCAP file a run: every message as it was sent, and what is needed to repeat the run.

A killed writer loses at most what came since the last flush; `repair.recover` mends such a file.
A writer whose disk is full ends its file while there is room for the index.
"""

import json
import time
from collections.abc import Mapping
from pathlib import Path

from mcap.writer import CompressionType, Writer

from services.runtime.log_file import ENCODING, PROFILE, LogError
from services.runtime.mailbox import Sample
from services.runtime.message_schemas import json_schema
from services.runtime.sink import Sink, free_bytes

FLUSH_S = 0.3
RESERVE_BYTES = 64_000_000
"""A file is ended when the disk has less room: for its index, and for what else runs here."""


class LogFullError(LogError):
    """The disk is full. The file holds what came before and is complete."""


class LogWriter:
    """Writes samples. Not thread safe.

    Raises:
        LogFullError: there is no room, now or later; the writer is closed then.
        LogError: the file cannot be made.
    """

    def __init__(
        self,
        path: Path,
        metadata: Mapping[str, Mapping[str, str]],
        reserve_bytes: int = RESERVE_BYTES,
    ) -> None:
        self.path = path
        self._reserve = reserve_bytes
        self._sink = _opened(path, reserve_bytes)
        self._writer = Writer(self._sink, compression=CompressionType.ZSTD)  # type: ignore[arg-type]
        self._channels: dict[tuple[str, int], int] = {}
        self._shown: dict[str, int] = {}
        self._sent_ns: dict[str, int] = {}
        self._closed = False
        self._flushed = time.monotonic()
        self._writer.start(profile=PROFILE, library="incognita")
        for name, fields in metadata.items():
            self._writer.add_metadata(name, dict(fields))

    def write(self, sample: Sample, log_ns: int) -> None:
        """Append one message; `log_ns` is when it was received."""
        sent_ns = self._sent_in_order(sample, log_ns)
        self._add(self._channel(sample), log_ns, sample.payload, sent_ns, sample.sequence)
        self.flush_if_due()

    def show(self, topic: str, schema: tuple[str, bytes], data: bytes, log_ns: int) -> None:
        """Append a message for viewers.

        Args:
            topic: its channel.
            schema: full name, and serialised protobuf `FileDescriptorSet`.
            data: serialised protobuf message.
            log_ns: when that was received which it shows.
        """
        if topic not in self._shown:
            name, descriptors = schema
            number = self._writer.register_schema(name, "protobuf", descriptors)
            self._shown[topic] = self._writer.register_channel(topic, "protobuf", number)
        self._add(self._shown[topic], log_ns, data, log_ns, 0)

    def flush_if_due(self) -> None:
        """Hand everything to the operating system, at most every `FLUSH_S`."""
        if time.monotonic() - self._flushed >= FLUSH_S:
            self.flush()

    def flush(self) -> None:
        """Hand everything to the operating system."""
        if self._closed:
            return
        self._check_room()
        try:
            self._writer.flush()
        except OSError as error:
            raise self._cut_off(error) from error
        self._flushed = time.monotonic()

    def close(self) -> None:
        """Write the index and close the file; safe to call twice."""
        if self._closed:
            return
        self._closed = True
        try:
            self._writer.finish()
        except OSError:
            self._sink.end_without_index()
        self._sink.close()

    def _sent_in_order(self, sample: Sample, log_ns: int) -> int:
        """When it was sent, but in the order in which it came: viewers want one order of a topic.

        Publishers of one topic overtake one another by a little, and by any amount where the clocks
        of their machines differ.
        """
        before_ns = self._sent_ns.get(sample.topic.key, 0)
        sent_ns = max(before_ns, min(sample.sent_ns, log_ns))
        self._sent_ns[sample.topic.key] = sent_ns
        return sent_ns

    def _add(self, channel: int, log_ns: int, data: bytes, sent_ns: int, sequence: int) -> None:
        try:
            self._writer.add_message(channel, log_ns, data, sent_ns, sequence & 0xFFFFFFFF)
        except OSError as error:
            raise self._cut_off(error) from error

    def _check_room(self) -> None:
        shortage = _shortage(self.path, self._reserve)
        if shortage:
            self.close()
            raise LogFullError(shortage)

    def _cut_off(self, error: OSError) -> LogFullError:
        """End the file where the last whole record ends."""
        self._closed = True
        self._sink.end_without_index()
        self._sink.close()
        return LogFullError(f"{self.path}: {error.strerror}")

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
                message_encoding=ENCODING,
                schema_id=schema,
                metadata={"publisher": str(sample.publisher)},
            )
        return self._channels[key]


def _opened(path: Path, reserve_bytes: int) -> Sink:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        shortage = _shortage(path, reserve_bytes)
        if shortage:
            raise LogFullError(shortage)
        return Sink(path)
    except OSError as error:
        raise LogError(f"{path}: cannot be written: {error.strerror}") from error


def _shortage(path: Path, reserve_bytes: int) -> str:
    """What is wrong with the room on the disk, or ""."""
    free = free_bytes(path.parent)
    if free >= reserve_bytes:
        return ""
    return (
        f"{path}: {free / 1e6:.1f} MB are left on the disk, "
        f"{reserve_bytes / 1e6:.0f} MB must stay free"
    )
