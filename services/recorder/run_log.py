"""A run as one file: every message for exact replay, and what viewers show of it."""

from pathlib import Path

from robots.catalogue import get_robot
from schemas.run import RunConfig
from services.recorder.viewer.channels import Viewer
from services.recorder.viewer.parts import schema_of
from services.runtime.mailbox import Sample
from services.runtime.provenance import run_metadata
from services.runtime.record import LogWriter

LATE_NS = 300_000_000
"""While the writer is behind by more than this, messages are kept but not shown."""


class RunLog:
    """Writes one file. What it raises are the errors of `LogWriter`."""

    def __init__(self, path: Path, run: RunConfig) -> None:
        self._writer = LogWriter(path, run_metadata(run))
        self._viewer = Viewer(get_robot(run.robot))

    def write(self, sample: Sample, log_ns: int) -> None:
        """Append one message, received at `log_ns`, and what is seen of it."""
        self._writer.write(sample, log_ns)
        if log_ns - sample.sent_ns > LATE_NS:
            return
        for shown in self._viewer.show(sample):
            schema, data = schema_of(type(shown.message)), shown.message.SerializeToString()
            self._writer.show(shown.topic, schema, data, log_ns)

    def flush_if_due(self) -> None:
        """Let nothing wait longer than the flush period."""
        self._writer.flush_if_due()

    def close(self) -> None:
        """Complete the file; safe to call twice."""
        self._writer.close()
