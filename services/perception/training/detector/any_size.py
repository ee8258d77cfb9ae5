"""Makes an exported detector take pictures of any size, so that parts of a picture can be shown.

An export of one size holds the places of its cells as constants; all else follows the input. Here
they are computed from the maps themselves: a running sum over ones counts columns and rows.

    python -m services.perception.training.detector.any_size detector.onnx
"""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import onnx
from numpy.typing import NDArray
from onnx import helper, numpy_helper

from services.perception.detection.card import read_card
from services.perception.weight_files import file_sha256, write_card

_strides = (8, 16, 32)
_maps = "/network/heads.{}/Concat_output_0"
_predictions = "/network/Concat_output_0"
_constants = ("centers", "sizes")
"""What a size is written down in: middles of all cells as x, y, and their sides [px]."""


class NotOurExportError(ValueError):
    """A network in which the places of the cells are not where ours have them."""


def make_any_size(model: onnx.ModelProto) -> None:
    """Let the input of an export of ours have any height and width, in place, if it does not yet.

    Raises:
        NotOurExportError: the graph is laid out otherwise.
    """
    graph = model.graph
    if not graph.input[0].type.tensor_type.shape.dim[2].dim_value:
        return
    made = {name for node in graph.node for name in node.output}
    made |= {tensor.name for tensor in graph.initializer}
    wanted = {*_constants, _predictions, *(_maps.format(k) for k in range(len(_strides)))}
    if not wanted <= made:
        missing = ", ".join(sorted(wanted - made))
        raise NotOurExportError(f"no export of ours: there is no {missing} in it")
    _drop_constants(graph)
    nodes = list(graph.node)
    after = next(row for row, node in enumerate(nodes) if _predictions in node.output) + 1
    del graph.node[:]
    graph.node.extend(nodes[:after] + _cells(graph) + nodes[after:])
    _free_sizes(graph)
    onnx.checker.check_model(model)


def _drop_constants(graph: onnx.GraphProto) -> None:
    stored = {*_constants, *(f"{name}_half" for name in _constants)}
    for tensor in [tensor for tensor in graph.initializer if tensor.name in stored]:
        graph.initializer.remove(tensor)
    for node in [node for node in graph.node if node.output[0] in _constants]:
        graph.node.remove(node)


def _free_sizes(graph: onnx.GraphProto) -> None:
    """Sizes that follow from the input's are no longer noted."""
    height, width = graph.input[0].type.tensor_type.shape.dim[2:]
    height.dim_param, width.dim_param = "height", "width"
    graph.output[0].type.tensor_type.shape.dim[1].dim_param = "cells"
    del graph.value_info[:]


def _cells(graph: onnx.GraphProto) -> list[onnx.NodeProto]:
    """Nodes that make `centers` (1, N, 2) and `sizes` (1, N, 1)."""
    nodes: list[onnx.NodeProto] = []

    def constant(name: str, values: NDArray[np.float32 | np.int64]) -> str:
        graph.initializer.append(numpy_helper.from_array(values, f"cells/{name}"))
        return f"cells/{name}"

    def node(operator: str, inputs: Sequence[str], name: str, **settings: Any) -> str:
        nodes.append(helper.make_node(operator, inputs, [name], **settings))
        return name

    first, second = constant("0", np.array([0])), constant("1", np.array([1]))
    nought, unit = (constant(f"{v}f", np.array(v, np.float32)) for v in (0, 1))
    half = constant("half", np.array(-0.5, np.float32))
    rows, columns = constant("rows", np.array(2)), constant("columns", np.array(3))
    pairs, singles = constant("xy", np.array([1, 2, -1])), constant("x", np.array([1, 1, -1]))
    centers, sizes = list[str](), list[str]()
    for k, stride in enumerate(_strides):
        at = f"cells/{k}/"
        side = constant(f"{k}/stride", np.array(stride, np.float32))
        channel = node("Slice", [_maps.format(k), first, second, second], f"{at}channel")
        ones = node("Add", [node("Mul", [channel, nought], f"{at}zeros"), unit], f"{at}ones")
        x = node("CumSum", [ones, columns], f"{at}x")
        y = node("CumSum", [ones, rows], f"{at}y")
        counted = node("Concat", [x, y], f"{at}xy", axis=1)
        middle = node("Mul", [node("Add", [counted, half], f"{at}middle"), side], f"{at}px")
        flat = node("Reshape", [middle, pairs], f"{at}flat")
        centers.append(node("Transpose", [flat], f"{at}centers", perm=[0, 2, 1]))
        flat = node("Reshape", [node("Mul", [ones, side], f"{at}side"), singles], f"{at}sides")
        sizes.append(node("Transpose", [flat], f"{at}sizes", perm=[0, 2, 1]))
    node("Concat", centers, _constants[0], axis=1)
    node("Concat", sizes, _constants[1], axis=1)
    return nodes


def main() -> None:
    """Change weights of ours in place, and their card with them."""
    path = Path(sys.argv[1])
    card, model = read_card(path), onnx.load(str(path))
    make_any_size(model)
    onnx.save(model, str(path))
    write_card(msgspec.structs.replace(card, sha256=file_sha256(path)), path)


if __name__ == "__main__":
    main()
