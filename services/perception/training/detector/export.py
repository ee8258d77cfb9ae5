"""The trained network as a file that OpenCV runs."""

from pathlib import Path

import numpy as np
import onnx
import torch
from onnx import helper, numpy_helper

from services.perception.detection.picture import input_height, input_width
from services.perception.training.detector.any_size import make_any_size
from services.perception.training.detector.network import DecodedNetwork, DetectorNetwork

_opset = 17
_smallest_halved = 256
"""Elements; smaller tensors (biases, shapes) stay as they are."""


def export_network(network: DetectorNetwork, path: Path) -> None:
    """Write an ONNX file with decoding inside and weights stored in half precision.

    The arithmetic stays in single precision: each weight passes through one Cast when the file is
    loaded. Graphs computed in half precision are not read by OpenCV.
    """
    decoded = DecodedNetwork(network, input_height, input_width)
    export(decoded, (input_height, input_width), "pictures", "predictions", path)
    model = onnx.load(str(path))
    make_any_size(model)
    onnx.save(model, str(path))


def export(
    network: torch.nn.Module, size: tuple[int, int], takes: str, gives: str, path: Path
) -> None:
    """Write an ONNX file of a network of pictures, with weights stored in half precision.

    Args:
        network: from pictures (1, 3, height, width) to one tensor.
        size: height and width of its input [px].
        takes: name of the input.
        gives: name of the output.
        path: of the file.
    """
    torch.onnx.export(
        network.eval(),
        (torch.zeros(1, 3, *size),),
        str(path),
        input_names=[takes],
        output_names=[gives],
        opset_version=_opset,
        # The newer exporter writes graphs that OpenCV does not read.
        dynamo=False,
    )
    model = onnx.load(str(path))
    store_in_half_precision(model)
    onnx.checker.check_model(model)
    onnx.save(model, str(path))


def store_in_half_precision(model: onnx.ModelProto) -> None:
    """Replace each large float32 initialiser by a float16 one and a Cast node, in place."""
    graph, casts = model.graph, list[onnx.NodeProto]()
    for tensor in graph.initializer:
        values = numpy_helper.to_array(tensor)
        if values.dtype == np.float32 and values.size >= _smallest_halved:
            name = tensor.name
            tensor.CopyFrom(numpy_helper.from_array(values.astype(np.float16), f"{name}_half"))
            casts.append(
                helper.make_node("Cast", [f"{name}_half"], [name], to=onnx.TensorProto.FLOAT)
            )
    nodes = [*casts, *graph.node]
    del graph.node[:]
    graph.node.extend(nodes)
