"""The file under a log: what is written is with the operating system at once, whole or not at all.

An MCAP writer hands over one whole record, or several, at a time. So a write that fails, because
the disk is full, is taken back to the end of the record before it, and the file stays readable.
"""

import os
import struct
from pathlib import Path

MAGIC = bytes((0x89, *b"MCAP0\r\n"))
"""What MCAP files begin and end with."""
_data_end = struct.pack("<BQI", 0x0F, 4, 0)
_footer = struct.pack("<BQQQI", 0x02, 20, 0, 0, 0)
_ending = _data_end + _footer + MAGIC
"""The end of an MCAP file without an index."""


class Sink:
    """A binary file that is only appended to. The stream of an MCAP writer."""

    def __init__(self, path: Path) -> None:
        self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o644)
        self._size = self._before = 0

    def write(self, data: bytes) -> int:
        """Append whole records.

        Raises:
            OSError: they do not fit; the file is as it was before.
        """
        left = memoryview(data)
        try:
            while left:
                left = left[os.write(self._file, left) :]
        except OSError:
            os.ftruncate(self._file, self._size)
            raise
        self._before, self._size = self._size, self._size + len(data)
        return len(data)

    def tell(self) -> int:
        """Bytes written."""
        return self._size

    def flush(self) -> None:
        """Nothing waits here."""

    def end_without_index(self) -> None:
        """Complete the file where there is no room for an index, nor for anything else.

        If need be, the last records make room.
        """
        for size in (self._size, self._before):
            os.ftruncate(self._file, size)
            os.lseek(self._file, size, os.SEEK_SET)
            self._size = size
            try:
                self.write(_ending)
            except OSError:
                continue
            return

    def close(self) -> None:
        """Close the file; safe to call twice."""
        if self._file >= 0:
            os.close(self._file)
            self._file = -1


def free_bytes(folder: Path) -> int:
    """Room on the disk of a folder, for this user."""
    disk = os.statvfs(folder)
    return disk.f_bavail * disk.f_frsize
