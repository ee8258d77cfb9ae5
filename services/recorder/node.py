"""The recorder as a process: it takes every message as it is."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from schemas.run import RunConfig
from schemas.topics import Handlers, Output
from services.runtime import clock
from services.runtime.mailbox import Sample
from services.runtime.provenance import run_metadata
from services.runtime.record import LogWriter


class RecorderNode:
    """A tap on all topics. A restarted recorder goes on in a file of its own."""

    def __init__(self, run: RunConfig, rng: np.random.Generator) -> None:
        del rng
        self._writer = LogWriter(unused_path(Path(run.log)), run_metadata(run))

    def handlers(self) -> Handlers:
        """None: every sample comes through `on_sample`."""
        return {}

    def on_sample(self, sample: Sample) -> Iterable[Output]:
        """Write one message."""
        self._writer.write(sample, clock.now_ns())
        return ()

    def on_idle(self) -> None:
        """Let nothing wait longer than the flush period, also when nothing arrives."""
        self._writer.flush_if_due()

    def close(self) -> None:
        """Complete the file."""
        self._writer.close()


def unused_path(path: Path) -> Path:
    """`path`, or with a number appended if it exists: a log is never overwritten."""
    candidates = (path.with_stem(f"{path.stem}-{part}") for part in range(2, 1000))
    return path if not path.exists() else next(c for c in candidates if not c.exists())
