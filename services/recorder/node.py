"""The recorder as a process: it takes every message as it is."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from schemas import topics
from schemas.faults import FaultLog
from schemas.run import RunConfig
from schemas.topics import Handlers, Output
from services.recorder.run_log import RunLog
from services.runtime import clock
from services.runtime.log_file import LogError
from services.runtime.mailbox import Sample
from services.runtime.record import RESERVE_BYTES
from services.runtime.sink import free_bytes

_retry_s = 5.0


class RecorderNode:
    """A tap on all topics. A restarted recorder goes on in a file of its own.

    While the disk is full nothing is recorded and the run goes on; when there is room again, so
    does the recording, in another file.
    """

    def __init__(self, run: RunConfig, rng: np.random.Generator) -> None:
        del rng
        self._run, self._path = run, Path(run.log)
        self._faults = FaultLog("recorder")
        self._retry = clock.Rate(1 / _retry_s)
        self._log = self._begin()

    def handlers(self) -> Handlers:
        """None: every sample comes through `on_sample`."""
        return {}

    def on_sample(self, sample: Sample) -> Iterable[Output]:
        """Write one message."""
        if self._log is not None:
            try:
                self._log.write(sample, clock.now_ns())
            except LogError as error:
                self._end(error)
        return self._said()

    def on_idle(self) -> Iterable[Output]:
        """Let nothing wait longer than the flush period, also when nothing arrives."""
        if self._log is None:
            self._log = self._begin() if self._retry.due() and self._has_room() else None
        else:
            try:
                self._log.flush_if_due()
            except LogError as error:
                self._end(error)
        return self._said()

    def close(self) -> None:
        """Complete the file."""
        if self._log is not None:
            self._log.close()

    def _begin(self) -> RunLog | None:
        try:
            return RunLog(unused_path(self._path), self._run)
        except LogError as error:
            self._end(error)
            return None

    def _end(self, error: LogError) -> None:
        self._log = None
        self._faults.note("recording stopped", str(error))

    def _has_room(self) -> bool:
        # More than is needed to go on: files of a second each would help nobody.
        folder = self._path.parent
        return folder.is_dir() and free_bytes(folder) > 2 * RESERVE_BYTES

    def _said(self) -> Iterable[Output]:
        return [topics.FAULT.of(fault) for fault in self._faults.due(clock.now_ns())]


def unused_path(path: Path) -> Path:
    """`path`, or with a number appended if it exists: a log is never overwritten."""
    candidates = (path.with_stem(f"{path.stem}-{part}") for part in range(2, 1000))
    return path if not path.exists() else next(c for c in candidates if not c.exists())
