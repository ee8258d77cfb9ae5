"""Darknet layers as nodes of an ONNX graph."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import onnx
from numpy.typing import NDArray
from onnx import helper, numpy_helper

from services.perception.errors import DetectorFileError
from services.perception.training.darknet.files import Section, WeightRow

_leak = 0.1


@dataclass(frozen=True)
class Tensor:
    """What a layer makes: (1, channels, height, width)."""

    name: str
    channels: int
    height: int
    width: int


@dataclass
class DarknetGraph:
    """Grows layer by layer; rows of decoded boxes collect on the way."""

    weights: WeightRow
    width: int
    """Of the input [px]."""
    height: int
    channels: int
    nodes: list[onnx.NodeProto] = field(default_factory=list[onnx.NodeProto])
    stored: list[onnx.TensorProto] = field(default_factory=list[onnx.TensorProto])
    made: list[Tensor] = field(default_factory=list[Tensor])
    """Outputs of the layers so far."""
    boxes: list[str] = field(default_factory=list[str])
    classes: int = 0

    def add(self, section: Section) -> None:
        """Add one layer.

        Raises:
            DetectorFileError: the layer is of a kind that is not known.
        """
        layers: dict[str, Callable[[Section], Tensor]] = {
            "convolutional": self._convolution,
            "maxpool": self._pooling,
            "upsample": self._upsampling,
            "route": self._route,
            "shortcut": self._shortcut,
            "yolo": self._boxes,
        }
        kind = section["type"]
        if kind not in layers:
            raise DetectorFileError(
                f"layer {len(self.made)} of the cfg is [{kind}]; known are {', '.join(layers)}"
            )
        self.made.append(layers[kind](section))

    def node(self, operator: str, inputs: Sequence[str], **attributes: Any) -> str:
        """Add a node of one output; returns the output's name."""
        name = f"{operator.lower()}{len(self.nodes)}"
        self.nodes.append(helper.make_node(operator, list(inputs), [name], **attributes))
        return name

    def constant(self, values: NDArray[np.float32] | NDArray[np.int64]) -> str:
        """Store values; returns their name."""
        name = f"constant{len(self.stored)}"
        self.stored.append(numpy_helper.from_array(values, name))
        return name

    @property
    def _last(self) -> Tensor:
        first = Tensor("picture", self.channels, self.height, self.width)
        return self.made[-1] if self.made else first

    def _at(self, index: int) -> Tensor:
        """A layer, counted from the first, or back from here if negative."""
        return self.made[index if index >= 0 else len(self.made) + index]

    def _convolution(self, section: Section) -> Tensor:
        filters, size = int(section["filters"]), int(section["size"])
        stride, groups = int(section.get("stride", 1)), int(section.get("groups", 1))
        pad = size // 2 if int(section.get("pad", 0)) else int(section.get("padding", 0))
        source = self._last
        normalised = bool(int(section.get("batch_normalize", 0)))
        weights = self.weights.convolution(filters, source.channels // groups, size, normalised)
        inputs = [source.name, self.constant(weights.kernel), self.constant(weights.bias)]
        output = self.node(
            "Conv",
            inputs,
            kernel_shape=[size, size],
            strides=[stride, stride],
            pads=[pad] * 4,
            group=groups,
        )
        height, width = (
            (side + 2 * pad - size) // stride + 1 for side in (source.height, source.width)
        )
        activated = self._activated(output, section.get("activation", "linear"))
        return Tensor(activated, filters, height, width)

    def _activated(self, name: str, activation: str) -> str:
        if activation == "linear":
            return name
        if activation == "leaky":
            return self.node("LeakyRelu", [name], alpha=_leak)
        if activation == "mish":
            smooth = self.node("Tanh", [self.node("Softplus", [name])])
            return self.node("Mul", [name, smooth])
        if activation == "swish":
            return self.node("Mul", [name, self.node("Sigmoid", [name])])
        operators = {"logistic": "Sigmoid", "relu": "Relu"}
        if activation not in operators:
            raise DetectorFileError(
                f"layer {len(self.made)} of the cfg has activation {activation!r}; "
                "known are linear, leaky, mish, swish, logistic, relu"
            )
        return self.node(operators[activation], [name])

    def _pooling(self, section: Section) -> Tensor:
        stride = int(section.get("stride", 1))
        size = int(section.get("size", stride))
        padding, source = int(section.get("padding", size - 1)), self._last
        before, after = padding // 2, padding - padding // 2
        name = self.node(
            "MaxPool",
            [source.name],
            kernel_shape=[size, size],
            strides=[stride, stride],
            pads=[before, before, after, after],
        )
        height, width = (
            (side + padding - size) // stride + 1 for side in (source.height, source.width)
        )
        return Tensor(name, source.channels, height, width)

    def _upsampling(self, section: Section) -> Tensor:
        factor, source = int(section.get("stride", 2)), self._last
        scales = self.constant(np.array([1, 1, factor, factor], np.float32))
        name = self.node(
            "Resize",
            [source.name, "", scales],
            mode="nearest",
            coordinate_transformation_mode="asymmetric",
            nearest_mode="floor",
        )
        return Tensor(name, source.channels, source.height * factor, source.width * factor)

    def _route(self, section: Section) -> Tensor:
        sources = [self._at(index) for index in _numbers(section["layers"])]
        groups, chosen = int(section.get("groups", 1)), int(section.get("group_id", 0))
        parts = [self._part(source, groups, chosen) for source in sources]
        name = parts[0] if len(parts) == 1 else self.node("Concat", parts, axis=1)
        channels = sum(source.channels for source in sources) // groups
        return Tensor(name, channels, sources[0].height, sources[0].width)

    def _part(self, source: Tensor, groups: int, chosen: int) -> str:
        """One of equal groups of channels."""
        if groups == 1:
            return source.name
        size = source.channels // groups
        return self._slice(source.name, chosen * size, (chosen + 1) * size, axis=1)

    def _slice(self, name: str, first: int, end: int, axis: int) -> str:
        limits = [self.constant(np.array([value], np.int64)) for value in (first, end, axis)]
        return self.node("Slice", [name, *limits])

    def _shortcut(self, section: Section) -> Tensor:
        source = self._last
        summed = [source.name, *(self._at(index).name for index in _numbers(section["from"]))]
        name = self.node("Add", summed[:2])
        for more in summed[2:]:
            name = self.node("Add", [name, more])
        activated = self._activated(name, section.get("activation", "linear"))
        return Tensor(activated, source.channels, source.height, source.width)

    def _boxes(self, section: Section) -> Tensor:
        """Decode a map of boxes into rows: middle, sides [px], objectness, class scores."""
        source, masks = self._last, _numbers(section["mask"])
        anchors = np.array(_reals(section["anchors"]), np.float32).reshape(-1, 2)[masks]
        self.classes = int(section["classes"])
        plain = bool(int(section.get("new_coords", 0)))
        shape = [1, len(masks), 5 + self.classes, source.height * source.width]
        table = self.node("Reshape", [source.name, self.constant(np.array(shape, np.int64))])
        table = self.node("Transpose", [table], perm=[0, 1, 3, 2])
        middles, sides, scores = (
            self._slice(table, *limits, axis=3)
            for limits in ((0, 2), (2, 4), (4, 5 + self.classes))
        )
        parts = [
            self._middles(middles, source, float(section.get("scale_x_y", 1)), plain),
            self._sides(sides, anchors, plain),
            scores if plain else self.node("Sigmoid", [scores]),
        ]
        rows = self.node("Concat", parts, axis=3)
        flat = self.constant(np.array([1, -1, 5 + self.classes], np.int64))
        self.boxes.append(self.node("Reshape", [rows, flat]))
        return source

    def _middles(self, name: str, source: Tensor, stretch: float, plain: bool) -> str:
        """Within the cell, from 0 to 1 or a little beyond; then in pixels of the input."""
        y, x = np.mgrid[: source.height, : source.width].astype(np.float32)
        stride = np.array([self.width / source.width, self.height / source.height], np.float32)
        cells = np.stack([x, y], -1).reshape(1, 1, -1, 2) - np.float32((stretch - 1) / 2)
        within = name if plain else self.node("Sigmoid", [name])
        scaled = self.node("Mul", [within, self.constant(stretch * stride)])
        return self.node("Add", [scaled, self.constant(cells * stride)])

    def _sides(self, name: str, anchors: NDArray[np.float32], plain: bool) -> str:
        """In anchors, by the exponential, or by the square of twice the value."""
        if not plain:
            return self.node(
                "Mul", [self.node("Exp", [name]), self.constant(anchors[None, :, None])]
            )
        squared = self.node("Mul", [name, name])
        return self.node("Mul", [squared, self.constant(4 * anchors[None, :, None])])


def _numbers(text: str) -> list[int]:
    return [int(value) for value in text.split(",")]


def _reals(text: str) -> list[float]:
    return [float(value) for value in text.split(",")]
