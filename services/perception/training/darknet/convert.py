"""Turns a Darknet network (YOLOv3 and v4 family) into an ONNX file that the robot can run.

    python -m services.perception.training.darknet.convert \
        yolov4-tiny.cfg yolov4-tiny.weights OUT.onnx --names coco.names --licence "public domain"

OpenCV reads Darknet files no longer. Boxes are decoded inside; the file beside it says how
pictures are shown to such networks. Needs onnx (`incognita[train]`).
"""

import argparse
import sys
from pathlib import Path

import msgspec
import onnx
from onnx import TensorProto, helper

from services.perception.detection.class_names import read_class_names
from services.perception.detection.layouts import Layout
from services.perception.detection.sidecar import Sidecar
from services.perception.errors import DetectorFileError, PerceptionError
from services.perception.training.darknet.files import WeightRow, read_sections
from services.perception.training.darknet.graph import DarknetGraph
from services.perception.weight_files import card_path

_opset, _ir_version = 17, 8


def convert(
    cfg: Path, weights: Path, out: Path, names: Path | None = None, licence: str = ""
) -> None:
    """Write the network, and beside it what it is to be shown and what its classes are called.

    Raises:
        DetectorFileError: the files do not belong together, or hold what is not known.
    """
    head, *layers = read_sections(cfg)
    row = WeightRow(weights)
    size = int(head.get("width", 416)), int(head.get("height", 416))
    graph = DarknetGraph(row, *size, int(head.get("channels", 3)))
    for layer in layers:
        graph.add(layer)
    row.require_used_up()
    if not graph.boxes:
        raise DetectorFileError(f"{cfg} has no [yolo] layer: it does not detect")
    classes = read_class_names(names) if names else ()
    if classes and len(classes) != graph.classes:
        raise DetectorFileError(
            f"{cfg} has {graph.classes} classes, but {names} names {len(classes)}"
        )
    onnx.save(_model(graph), str(out))
    # A picture is stretched to the input; that is how Darknet trains and detects.
    sidecar = Sidecar(
        classes=classes, placement="stretch", color="rgb", scale=1 / 255,
        layout=Layout.OBJECTNESS, licence=licence,
    )  # fmt: skip
    said = {name: value for name, value in msgspec.to_builtins(sidecar).items() if value}
    said.pop("calibration")
    card_path(out).write_bytes(msgspec.json.format(msgspec.json.encode(said), indent=1) + b"\n")


def _model(graph: DarknetGraph) -> onnx.ModelProto:
    rows = graph.node("Concat", graph.boxes, axis=1)
    picture = helper.make_tensor_value_info(
        "picture", TensorProto.FLOAT, [1, graph.channels, graph.height, graph.width]
    )
    predictions = helper.make_tensor_value_info(
        rows, TensorProto.FLOAT, [1, None, 5 + graph.classes]
    )
    made = helper.make_graph(graph.nodes, "darknet", [picture], [predictions], graph.stored)
    opset = [helper.make_opsetid("", _opset)]
    model = helper.make_model(made, opset_imports=opset, ir_version=_ir_version)
    onnx.checker.check_model(model)
    return model


def main() -> int:
    """Convert from the command line."""
    parser = argparse.ArgumentParser(description="Turn a Darknet network into an ONNX file.")
    parser.add_argument("cfg", type=Path)
    parser.add_argument("weights", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--names", type=Path, help="class names, one a line")
    parser.add_argument("--licence", default="", help="of the weights")
    given = parser.parse_args()
    try:
        convert(given.cfg, given.weights, given.out, given.names, given.licence)
    except (PerceptionError, OSError) as error:
        print(f"darknet: {error}", file=sys.stderr)
        return 2
    print(f"wrote {given.out} and {card_path(given.out)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
