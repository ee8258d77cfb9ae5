"""Results of episodes in a file, so that an experiment that was interrupted goes on where it was.

One line of JSON for each episode, with a digest of all that decides it: the revision of the code,
and what was asked. A line that was being written when the process died is skipped.
"""

import hashlib
import os
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

import msgspec
from msgspec import Struct

from schemas.errors import UserError
from services.runtime.provenance import git_revision
from sim.experiments.montecarlo_job import Job, Result


class _Line(Struct, frozen=True, kw_only=True):
    digest: str
    result: Result


class Kept:
    """Results that are there already, and where new ones go.

    Args:
        path: the file; need not exist.

    Raises:
        UserError: the code has no revision that results could be kept for.
    """

    def __init__(self, path: Path) -> None:
        self._path, self._revision = path, git_revision()
        if self._revision == "unknown" or self._revision.endswith("+"):
            raise UserError(
                f"--keep {path}: results are kept for a revision of the code, and this checkout "
                f"is {self._revision!r}; commit its changes first"
            )
        self._found = {line.digest: line.result for line in self._lines()}

    def result_of(self, job: Job) -> Result | None:
        """What became of the job when the same code ran it before."""
        return self._found.get(self._digest(job))

    def add(self, job: Job, result: Result) -> None:
        """Write a result down, at once."""
        self._path.parent.mkdir(parents=True, exist_ok=True)
        line = msgspec.json.encode(_Line(digest=self._digest(job), result=result))
        with self._path.open("a+b") as file:
            file.write(self._gap(file) + line + b"\n")

    @staticmethod
    def _gap(file: BinaryIO) -> bytes:
        """An end for a line that was cut off."""
        file.seek(0, os.SEEK_END)
        if not file.tell():
            return b""
        file.seek(-1, os.SEEK_END)
        return b"" if file.read(1) == b"\n" else b"\n"

    def _lines(self) -> Iterator[_Line]:
        if not self._path.exists():
            return
        for line in self._path.read_bytes().splitlines():
            try:
                yield msgspec.json.decode(line, type=_Line)
            except msgspec.DecodeError:
                continue

    def _digest(self, job: Job) -> str:
        asked = msgspec.json.encode((self._revision, job), order="deterministic")
        return hashlib.sha256(asked).hexdigest()
