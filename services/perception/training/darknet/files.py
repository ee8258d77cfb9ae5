"""The two files of a Darknet network: a cfg that lists its layers, and their weights in one row."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from schemas.arrays import Floats32
from services.perception.errors import DetectorFileError

Section = dict[str, str]
"""Options of one layer; `type` is the name in brackets."""

_epsilon = 1e-5
"""Added to the variance in batch normalisation."""


@dataclass(frozen=True)
class ConvolutionWeights:
    """A convolution with its batch normalisation worked in."""

    kernel: Floats32
    """(filters, channels, size, size)"""
    bias: Floats32
    """(filters,)"""


def read_sections(path: Path) -> list[Section]:
    """Sections of a cfg in order, the first of which describes the input.

    Raises:
        DetectorFileError: it cannot be read, or is no cfg.
    """
    sections: list[Section] = []
    for line in _text(path).splitlines():
        line = line.partition("#")[0].strip()  # noqa: PLW2901
        if line.startswith("["):
            sections.append({"type": line.strip("[] ")})
        elif line:
            name, _, value = line.partition("=")
            if not sections or not value:
                raise DetectorFileError(f"{path} is no Darknet cfg: it says {line[:40]!r}")
            sections[-1][name.strip()] = value.strip()
    if not sections or sections[0]["type"] not in ("net", "network"):
        raise DetectorFileError(f"{path} is no Darknet cfg: it does not begin with [net]")
    return sections


class WeightRow:
    """All weights of a network one after the other, handed out layer by layer."""

    def __init__(self, path: Path) -> None:
        data = path.read_bytes()
        version = np.frombuffer(data, "<i4", 3) if len(data) >= 12 else np.zeros(3, np.int32)
        # The number of pictures seen takes eight bytes since version 0.2, four before.
        start = 20 if version[0] * 10 + version[1] >= 2 else 16
        size = (len(data) - start) // 4
        if size <= 0 or (len(data) - start) % 4:
            raise DetectorFileError(f"{path} ({len(data)} bytes) holds no Darknet weights")
        self._path, self._at = path, 0
        self._values = np.frombuffer(data, "<f4", size, start)

    def convolution(
        self, filters: int, channels: int, size: int, normalised: bool
    ) -> ConvolutionWeights:
        """Weights of the next convolution."""
        bias = self._take(filters)
        if normalised:
            scale, mean, variance = (self._take(filters) for _ in range(3))
            factor = (scale / np.sqrt(variance + _epsilon)).astype(np.float32)
            bias = (bias - mean * factor).astype(np.float32)
        else:
            factor = np.ones(filters, np.float32)
        kernel = self._take(filters * channels * size**2).reshape(filters, channels, size, size)
        return ConvolutionWeights(kernel * factor[:, None, None, None], bias)

    def require_used_up(self) -> None:
        """Refuse weights that the cfg had no layer for: they are of another network."""
        if self._at != len(self._values):
            raise DetectorFileError(
                f"{self._path} holds {len(self._values)} weights, "
                f"but the layers of the cfg take {self._at}: they are not of one network"
            )

    def _take(self, count: int) -> Floats32:
        if self._at + count > len(self._values):
            raise DetectorFileError(
                f"{self._path} holds {len(self._values)} weights, which is too few for the cfg: "
                "they are not of one network"
            )
        self._at += count
        return self._values[self._at - count : self._at].astype(np.float32)


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise DetectorFileError(f"cannot read {path}: {error}") from error
