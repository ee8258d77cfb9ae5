"""Boxes in a camera picture, by a network that OpenCV runs on one core."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import msgspec
import numpy as np
from numpy.typing import NDArray

from schemas.arrays import Floats
from services.perception.detection.boxes import Boxes, in_picture, joined, likely, suppressed
from services.perception.detection.calibration import Calibration
from services.perception.detection.card import read_card
from services.perception.detection.decoding import Decoder
from services.perception.detection.gaze import EVERYTHING, Gaze, Part, cut_off
from services.perception.detection.layouts import Layout, Outputs, Recognised, recognised
from services.perception.detection.picture import Preprocessing
from services.perception.detection.reading import read_network_file
from services.perception.errors import DetectorFileError

default_weights = Path(__file__).parent.parent / "weights" / "detector.onnx"
usual_threshold = 0.25
"""Least score of a box where neither a card nor a person says another."""
_probe_size = 320, 240
"""Width and height of the first picture [px]."""
_grey = 0.45
"""Of the first picture. To a network that takes bytes it is black, which does as well."""


class Network:
    """An ONNX file run by OpenCV: (1, 3, H, W) in, all its outputs out."""

    def __init__(self, weights: Path) -> None:
        # Process-wide. One thread already gives 50 frames/s; more would only starve the others.
        cv2.setNumThreads(1)
        self._weights, self._net = weights, _loaded(weights)
        self._outputs: Sequence[str] = self._net.getUnconnectedOutLayersNames()

    def __call__(self, blob: NDArray[np.float32]) -> list[NDArray[np.float32]]:
        """Outputs for one blob, in the order of the file.

        Raises:
            DetectorFileError: OpenCV cannot run the network on it.
        """
        try:
            self._net.setInput(blob)
            outputs: Sequence[Any] = self._net.forward(self._outputs)
        except cv2.error as error:
            raise DetectorFileError(
                f"OpenCV cannot run {self._weights} on a picture {blob.shape}: {error.err}"
            ) from error
        return [np.asarray(output, np.float32) for output in outputs]


def _loaded(weights: Path) -> cv2.dnn.Net:
    refusal = f"OpenCV cannot load the network in {weights}"
    try:
        net = cv2.dnn.readNetFromONNX(str(weights), engine=cv2.dnn.ENGINE_NEW)
    except cv2.error as error:
        raise DetectorFileError(f"{refusal}: {error.err}") from error
    # A file that is ONNX, but holds what the new engine cannot run, gives an empty net instead.
    if net.empty():
        raise DetectorFileError(f"{refusal}: it has operators that OpenCV does not know")
    return net


class Detector:
    """Finds the objects of a network's classes in pictures of any size.

    Raises:
        DetectorFileError: the network, its class names or its sidecar cannot be used.
        MissingWeightsError: our own weights or their card are missing or do not belong together.
    """

    def __init__(
        self,
        weights: Path = default_weights,
        class_file: Path | None = None,
        threshold: float | None = None,
    ) -> None:
        if weights == default_weights:
            # Without its card it would be taken for a stranger's.
            read_card(weights)
        self._reading = read_network_file(weights, class_file)
        said = self._reading.sidecar
        self.threshold = threshold or said.threshold or usual_threshold
        self._network = Network(weights)
        # The first forward pass allocates and packs weights: not while a robot waits for it.
        self._found = self._probed()
        self._shown = self._reading.preprocessing(self._found.layout, self._found.boxes_a_cell)

    @property
    def classes(self) -> tuple[str, ...]:
        """Names of the C classes."""
        return self._reading.classes

    @property
    def calibration(self) -> Calibration:
        """From scores to probabilities."""
        return self._reading.sidecar.calibration

    @property
    def description(self) -> str:
        """What the file was taken for, in one line."""
        shown = self._shown_at(*_probe_size)
        size = f"{shown.width}x{shown.height} px" if self._reading.fixed else "any size"
        return (
            f"{self._reading.path}: {len(self.classes)} classes, layout {self._found}, "
            f"input {size}, {shown}; licence: {self._reading.licence or 'not said in the file'}"
        )

    @property
    def groups(self) -> tuple[tuple[str, ...], ...]:
        """Classes by network: it is one."""
        return (self.classes,)

    def detect(self, color: NDArray[np.uint8], gaze: Gaze = EVERYTHING) -> Boxes:
        """Boxes in an RGB picture (H, W, 3), or in the parts of it that are looked at.

        Raises:
            DetectorFileError: the network cannot be run on it, or named a class without a name.
        """
        height, width = color.shape[:2]
        shown = self._shown_at(width, height)
        padded = shown.padded(color)
        found = [
            self._read(self._network(shown.blob_of(padded[part])), part, shown)
            for part in self._parts(gaze, width, height)
        ]
        return self._finished(joined(found, len(self.classes)), width, height)

    def outputs(self, color: NDArray[np.uint8]) -> Outputs:
        """What the network answers to all of an RGB picture (H, W, 3), not yet read.

        Raises:
            DetectorFileError: the network cannot be run on it.
        """
        height, width = color.shape[:2]
        return self._network(self._shown_at(width, height).blob(color))

    def read(self, outputs: Outputs, width: int, height: int) -> Boxes:
        """Boxes that the network's outputs tell of, in a picture of `width` x `height` px."""
        shown = self._shown_at(width, height)
        whole = slice(0, shown.height), slice(0, shown.width)
        return self._finished(self._read(outputs, whole, shown), width, height)

    def pixels(self, width: int, height: int, gaze: Gaze = EVERYTHING) -> int:
        """Of the network's input that a look at a picture of `width` x `height` px takes."""
        parts = self._parts(gaze, width, height)
        return sum((y.stop - y.start) * (x.stop - x.start) for y, x in parts)

    def looked_at(self, width: int, height: int, gaze: Gaze = EVERYTHING) -> Floats:
        """Parts (R, 4) x0 y0 x1 y1 [px] of a picture of `width` x `height` px that it is shown."""
        parts = self._parts(gaze, width, height)
        corners = [[x.start, y.start, x.stop, y.stop] for y, x in parts]
        fit = self._shown_at(width, height).fit(width, height)
        return fit.to_picture(np.array(corners, np.float64).reshape(-1, 4))

    def _parts(self, gaze: Gaze, width: int, height: int) -> list[Part]:
        shown = self._shown_at(width, height)
        fit = shown.fit(width, height)
        parts = gaze.parts(fit, shown.width, shown.height)
        # A network of one size takes its whole input, if there is anything to look at.
        takes_parts = self._reading.any_size or not parts
        return parts if takes_parts else EVERYTHING.parts(fit, shown.width, shown.height)

    def _read(self, outputs: Outputs, part: Part, shown: Preprocessing) -> Boxes:
        """Boxes in the input that the outputs for a part of it tell of."""
        rows, columns = part
        width, height = columns.stop - columns.start, rows.stop - rows.start
        decode = Decoder(self._found, len(self.classes), width, height)
        boxes = likely(decode(outputs), self.threshold, self.calibration)
        offset = np.array([columns.start, rows.start] * 2, np.float64)
        moved = replace(boxes, corners_px=boxes.corners_px + offset)
        return moved.selected(~cut_off(moved.corners_px, part, shown.width, shown.height))

    def _finished(self, boxes: Boxes, width: int, height: int) -> Boxes:
        boxes = in_picture(boxes, self._shown_at(width, height).fit(width, height))
        return boxes if self._found.layout is Layout.END_TO_END else suppressed(boxes)

    def _shown_at(self, width: int, height: int) -> Preprocessing:
        """How a picture of this size [px] is shown to the network."""
        size = self._reading.input_size(width, height)
        return msgspec.structs.replace(self._shown, width=size[0], height=size[1])

    def _probed(self) -> Recognised:
        """What the answer to a grey picture is laid out like."""
        reading = self._reading
        width, height = reading.input_size(*_probe_size)
        outputs = self._network(np.full((1, 3, height, width), _grey, np.float32))
        try:
            return recognised(outputs, reading.question(width, height))
        except DetectorFileError as error:
            raise DetectorFileError(f"{reading.path}: {error}") from error
