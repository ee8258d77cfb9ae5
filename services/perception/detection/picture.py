"""How a camera picture becomes a network's input: the same in training and at run time."""

from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from schemas.arrays import Floats

input_width, input_height = 320, 256
"""Of our own network's input [px]; both are multiples of 32."""
padding_value = 114
"""Grey of what the picture does not cover."""

ColorOrder = Literal["rgb", "bgr"]
Placement = Literal["centre", "top_left", "stretch"]


@dataclass(frozen=True)
class Fit:
    """Where the picture lies in the input: input = picture * scale + offset, as x, y."""

    scale: tuple[float, float]
    offset: tuple[int, int]
    size: tuple[int, int]
    """Width and height of the picture [px]."""

    def to_picture(self, corners: Floats) -> Floats:
        """Corner boxes (N, 4) of the input [px] as boxes in the picture [px], cut at its edge."""
        within = (corners - [*self.offset, *self.offset]) / [*self.scale, *self.scale]
        return np.clip(within, 0, [*self.size, *self.size])


class Preprocessing(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What a network was trained to be shown. Networks of other makes differ silently."""

    width: int = input_width
    """Of the input [px]."""
    height: int = input_height
    """[px]"""
    color: ColorOrder = "rgb"
    scale: float = 1 / 255
    """Pixels are multiplied by this."""
    placement: Placement = "top_left"
    """Where the picture lies if its sides are in another proportion; `stretch` distorts it."""
    fill: int = padding_value
    """Grey of what the picture does not cover."""

    def __str__(self) -> str:
        placed = self.placement.replace("_", " ")
        return f"{self.color.upper()} x {self.scale:.3g}, {placed}"

    def fit(self, width: int, height: int) -> Fit:
        """Where a picture of this size [px] lies in the input."""
        size = width, height
        if self.placement == "stretch":
            return Fit((self.width / width, self.height / height), (0, 0), size)
        scale = min(self.width / width, self.height / height)
        if self.placement == "top_left":
            return Fit((scale, scale), (0, 0), size)
        spare = self.width - round(width * scale), self.height - round(height * scale)
        # Of an odd number of spare rows the upper half is the smaller one.
        return Fit((scale, scale), (spare[0] // 2, spare[1] // 2), size)

    def blob(self, picture: NDArray[np.uint8]) -> NDArray[np.float32]:
        """Network input (1, 3, `height`, `width`) of an RGB picture (H, W, 3)."""
        return self.blob_of(self.padded(picture))

    def blob_of(self, padded: NDArray[np.uint8]) -> NDArray[np.float32]:
        """The same (1, 3, h, w) of a picture that fits the input already, or of a part of it."""
        swapped = self.color == "bgr"
        blob = cv2.dnn.blobFromImage(padded, scalefactor=self.scale, swapRB=swapped)
        return np.asarray(blob, np.float32)

    def padded(self, picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """The picture as it lies in the input, (`height`, `width`, 3)."""
        height, width = picture.shape[:2]
        fit = self.fit(width, height)
        size = max(round(width * fit.scale[0]), 1), max(round(height * fit.scale[1]), 1)
        if size != (width, height):
            resized = cv2.resize(picture, size, interpolation=cv2.INTER_LINEAR)
            picture = np.asarray(resized, np.uint8)
        x, y = fit.offset
        padded = np.full((self.height, self.width, 3), self.fill, np.uint8)
        padded[y : y + size[1], x : x + size[0]] = picture
        return padded


own_preprocessing = Preprocessing()
"""Of the network that is trained here."""


def network_input(color: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Input (1, 3, 256, 320) of our own network: RGB in [0, 1] of a picture (H, W, 3).

    A picture of 320x240 px keeps its scale and lies in the upper left corner.
    """
    return own_preprocessing.blob(color)
