"""An export of one size becomes one of any size, and answers as before."""

import cv2
import numpy as np
import pytest

onnx = pytest.importorskip("onnx", reason="onnx is not installed")
from onnx import TensorProto, helper, numpy_helper  # noqa: E402

from services.perception.detection.detector import default_weights  # noqa: E402
from services.perception.detection.reading import read_network_file  # noqa: E402
from services.perception.training.detector.any_size import (  # noqa: E402
    NotOurExportError,
    make_any_size,
)

STRIDES = (8, 16, 32)


def export(width: int, height: int) -> "onnx.ModelProto":
    """Laid out as exports of ours: means of cells, behind the places and sides of these."""
    nodes, rows = [], []
    stored = [numpy_helper.from_array(np.array([1, 3, -1]), "row")]
    for k, stride in enumerate(STRIDES):
        name = f"/network/heads.{k}/Concat_output_0"
        cell = {"kernel_shape": [stride] * 2, "strides": [stride] * 2}
        nodes += [
            helper.make_node("AveragePool", ["pictures"], [name], **cell),
            helper.make_node("Reshape", [name, "row"], [f"flat{k}"]),
            helper.make_node("Transpose", [f"flat{k}"], [f"rows{k}"], perm=[0, 2, 1]),
        ]
        rows.append(f"rows{k}")
    centers, sizes = cells(width, height)
    stored += [numpy_helper.from_array(centers.astype(np.float16), "centers_half")]
    stored += [numpy_helper.from_array(sizes.astype(np.float16), "sizes_half")]
    float32 = TensorProto.FLOAT
    nodes += [helper.make_node("Concat", rows, ["/network/Concat_output_0"], axis=1)]
    nodes = [
        *(helper.make_node("Cast", [f"{n}_half"], [n], to=float32) for n in ("centers", "sizes")),
        *nodes,
        helper.make_node("Mul", ["/network/Concat_output_0", "sizes"], ["scaled"]),
        helper.make_node("Slice", ["scaled", "from", "to", "axis"], ["pair"]),
        helper.make_node("Add", ["pair", "centers"], ["moved"]),
        helper.make_node("Concat", ["moved", "scaled"], ["predictions"], axis=2),
    ]
    for name, value in (("from", 0), ("to", 2), ("axis", 2)):
        stored.append(numpy_helper.from_array(np.array([value]), name))
    takes = helper.make_tensor_value_info("pictures", float32, [1, 3, height, width])
    gives = helper.make_tensor_value_info("predictions", float32, [1, len(centers), 5])
    graph = helper.make_graph(nodes, "export", [takes], [gives], stored)
    return helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)


def cells(width: int, height: int) -> tuple[np.ndarray, np.ndarray]:
    centers, sizes = [], []
    for stride in STRIDES:
        y, x = np.mgrid[0 : height // stride, 0 : width // stride]
        centers.append((np.stack([x, y], -1).reshape(-1, 2) + 0.5) * stride)
        sizes.append(np.full((len(centers[-1]), 1), float(stride)))
    return np.concatenate(centers), np.concatenate(sizes)


def answer(model: "onnx.ModelProto", picture: np.ndarray) -> np.ndarray:
    data = np.frombuffer(model.SerializeToString(), np.uint8)
    net = cv2.dnn.readNetFromONNX(data, engine=cv2.dnn.ENGINE_NEW)
    assert not net.empty()
    net.setInput(picture)
    return np.asarray(net.forward("predictions"))


@pytest.mark.parametrize("size", [(128, 96), (64, 32), (160, 224)])
def test_at_every_size_it_answers_as_an_export_of_that_size(size: tuple[int, int]):
    picture = np.random.default_rng(0).random((1, 3, size[1], size[0])).astype(np.float32)
    model = export(128, 96)
    make_any_size(model)
    np.testing.assert_allclose(answer(model, picture), answer(export(*size), picture), atol=1e-5)


def test_doing_it_again_changes_nothing():
    model = export(128, 96)
    make_any_size(model)
    before = model.SerializeToString()
    make_any_size(model)
    assert model.SerializeToString() == before


def test_a_network_of_another_make_is_refused_and_left_as_it_was():
    model = export(128, 96)
    model.graph.node[2].output[0] = "something else"
    before = model.SerializeToString()
    with pytest.raises(NotOurExportError, match=r"no /network/heads.0/Concat_output_0 in it"):
        make_any_size(model)
    assert model.SerializeToString() == before


def test_our_own_weights_take_parts_of_a_picture_and_whole_ones_at_their_size():
    reading = read_network_file(default_weights, None)
    assert reading.any_size
    assert reading.input_size(640, 480) == (320, 256)
