"""Plays a log back over the bus: the same messages in the same order, at any speed."""

import threading
import time
from collections.abc import Callable, Collection, Iterable
from pathlib import Path

import msgspec

from schemas.run import RunConfig
from schemas.topics import ALL_TOPICS
from services.runtime.log_file import LogError, LogRecord, log_summary, read_log
from services.runtime.wire import Bus

_topics = {topic.key: topic for topic in ALL_TOPICS}


def recorded_run(path: Path) -> RunConfig:
    """The settings a log was recorded with; defaults where it does not say.

    Raises:
        LogError: not a readable log, or its settings are none.
    """
    recorded = log_summary(path)["metadata"].get("run", {})
    try:
        known = {
            name: msgspec.json.decode(text) if text.startswith("[") else text
            for name, text in recorded.items()
            if name in RunConfig.__struct_fields__
        }
        return msgspec.convert(known, RunConfig, strict=False)
    except (msgspec.DecodeError, msgspec.ValidationError) as error:
        raise LogError(f"{path}: settings of another version of the code: {error}") from error


def play(
    path: Path,
    bus: Bus,
    rate: float,
    stop: threading.Event,
    on_record: Callable[[LogRecord], None],
    left_out: Collection[str] = (),
) -> None:
    """Publish a log's messages; `rate` 2 is twice as fast, 0 is without waiting."""
    for record in paced(read_log(path), rate, stop):
        topic = _topics.get(record.topic)
        if topic is not None and record.topic not in left_out:
            bus.publish_bytes(topic, record.data, record.sequence)
            on_record(record)


def paced(records: Iterable[LogRecord], rate: float, stop: threading.Event) -> Iterable[LogRecord]:
    """The records, each when its time has come; ends early when `stop` is set."""
    first_ns: int | None = None
    started = time.monotonic()
    for record in records:
        first_ns = record.log_ns if first_ns is None else first_ns
        due = started + (record.log_ns - first_ns) / 1e9 / rate if rate > 0 else 0.0
        if stop.is_set() or (due > time.monotonic() and stop.wait(due - time.monotonic())):
            return
        yield record
