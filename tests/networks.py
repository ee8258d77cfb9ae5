"""Small networks as ONNX files: what they answer is known, and depends on what they are shown."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

Sizes = Sequence[int | str]


def answering(
    path: Path,
    answers: Mapping[str, np.ndarray],
    size: tuple[int, int] = (128, 96),
    metadata: Mapping[str, str] | None = None,
    swing: float = 0.0,
) -> dict[str, np.ndarray]:
    """Write a network that gives these answers, plus `swing` x random weights x channel means.

    `size` is width and height. Returns the weights (3, ...) of the channel means of each answer.
    """
    rng = np.random.default_rng(0)
    nodes = [
        helper.make_node("GlobalAveragePool", ["picture"], ["pooled"]),
        helper.make_node("Reshape", ["pooled", "row"], ["means"]),
    ]
    stored, weights = [numpy_helper.from_array(np.array([1, 3]), "row")], {}
    for name, answer in answers.items():
        weights[name] = (swing * rng.normal(size=(3, *answer.shape))).astype(np.float32)
        stored += [
            numpy_helper.from_array(weights[name].reshape(3, -1), f"{name}_weights"),
            numpy_helper.from_array(answer.astype(np.float32), f"{name}_base"),
            numpy_helper.from_array(np.array(answer.shape), f"{name}_shape"),
        ]
        nodes += [
            helper.make_node("MatMul", ["means", f"{name}_weights"], [f"{name}_flat"]),
            helper.make_node("Reshape", [f"{name}_flat", f"{name}_shape"], [f"{name}_swung"]),
            helper.make_node("Add", [f"{name}_swung", f"{name}_base"], [name]),
        ]
    shapes = {name: answer.shape for name, answer in answers.items()}
    save(path, nodes, stored, (1, 3, size[1], size[0]), shapes, metadata)
    return weights


def convolving(path: Path, channels: int, metadata: Mapping[str, str] | None = None) -> list:
    """Write a network of any size: (1, channels, N), one convolution for each stride.

    Every cell answers with the same box, 15 15 25 25 in the input, and with random scores of what
    it is shown. Returns weights (channels, 3, stride, stride) by stride.
    """
    rng = np.random.default_rng(1)
    box = np.array([20, 20, 10, 10] + [0] * (channels - 4), np.float32)
    stored = [
        numpy_helper.from_array(np.array([1, channels, -1]), "row"),
        numpy_helper.from_array(box, "box"),
    ]
    nodes, weights = [], []
    for stride in (8, 16, 32):
        kernel = rng.normal(size=(channels, 3, stride, stride)).astype(np.float32) / stride
        kernel[:4] = 0
        weights.append(kernel)
        stored.append(numpy_helper.from_array(kernel, f"kernel{stride}"))
        nodes += [
            helper.make_node(
                "Conv",
                ["picture", f"kernel{stride}", "box"],
                [f"map{stride}"],
                strides=[stride, stride],
                kernel_shape=[stride, stride],
            ),
            helper.make_node("Reshape", [f"map{stride}", "row"], [f"rows{stride}"]),
        ]
    rows = [f"rows{stride}" for stride in (8, 16, 32)]
    nodes.append(helper.make_node("Concat", rows, ["output0"], axis=2))
    shapes = {"output0": (1, channels, "boxes")}
    save(path, nodes, stored, (1, 3, "height", "width"), shapes, metadata)
    return weights


def save(
    path: Path,
    nodes: Sequence[onnx.NodeProto],
    stored: Sequence[onnx.TensorProto],
    shape: Sizes,
    outputs: Mapping[str, Sizes],
    metadata: Mapping[str, str] | None = None,
) -> None:
    """Write a graph from `picture` to `outputs`."""
    graph = helper.make_graph(
        list(nodes),
        "network",
        [helper.make_tensor_value_info("picture", TensorProto.FLOAT, list(shape))],
        [
            helper.make_tensor_value_info(name, TensorProto.FLOAT, list(sizes))
            for name, sizes in outputs.items()
        ],
        list(stored),
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    helper.set_model_props(model, dict(metadata or {}))
    onnx.save(model, str(path))
