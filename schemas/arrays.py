"""Array fields of messages: element type in the annotation, named dimensions in `Shape`.

A field reads `positions: Annotated[Floats, Shape("N 3")]`. Sizes given as letters must agree
between the fields of one message, so a message of columns cannot be decoded half long.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

type_codes: dict[int, np.dtype[Any]] = {
    1: np.dtype("<f8"),
    2: np.dtype("<f4"),
    3: np.dtype("<i8"),
    4: np.dtype("<i4"),
    5: np.dtype("<u2"),
    6: np.dtype("u1"),
    7: np.dtype("i1"),
    8: np.dtype("?"),
}
"""Element types that may cross a process boundary. Object arrays never do."""

Floats = NDArray[np.float64]
Floats32 = NDArray[np.float32]
Ints = NDArray[np.int32]
Words = NDArray[np.uint16]
Bytes = NDArray[np.uint8]
SignedBytes = NDArray[np.int8]
Flags = NDArray[np.bool_]


@dataclass(frozen=True)
class Shape:
    """Dimensions of an array field: letters are free but must agree, digits are exact."""

    dimensions: str

    def mismatch(self, shape: tuple[int, ...], sizes: dict[str, int]) -> str | None:
        """Say what is wrong with `shape`, or None; new letters are added to `sizes`."""
        names = self.dimensions.split()
        if len(names) != len(shape):
            return f"expected {len(names)} dimensions ({self.dimensions}), got shape {shape}"
        for name, size in zip(names, shape, strict=True):
            expected = int(name) if name.isdigit() else sizes.setdefault(name, size)
            if size != expected:
                return f"expected {name} = {expected}, got shape {shape}"
        return None
