"""A fingerprint of everything that was said in a run."""

import hashlib
import struct

from services.runtime.mailbox import Sample


class Trace:
    """Hash over (topic, time, bytes) of every message, in order."""

    def __init__(self) -> None:
        self._hash = hashlib.sha256()
        self.messages = 0

    def note(self, publisher: str, stamp_ns: int, sample: Sample) -> None:
        """Add one message."""
        del publisher
        self.messages += 1
        key = sample.topic.key.encode()
        self._hash.update(struct.pack("<HqQ", len(key), stamp_ns, len(sample.payload)))
        self._hash.update(key)
        self._hash.update(sample.payload)

    @property
    def sha256(self) -> str:
        """Hexadecimal digest so far."""
        return self._hash.hexdigest()
