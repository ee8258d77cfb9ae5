"""What is read from an ONNX file without any package that knows the format."""

from pathlib import Path

import numpy as np
import pytest

from services.perception.detection.class_names import names_in_metadata
from services.perception.detection.detector import default_weights
from services.perception.detection.onnx_file import Port, read_onnx_file
from services.perception.errors import DetectorFileError


def test_our_own_weights_are_what_they_are():
    file = read_onnx_file(default_weights)
    assert [port.shape for port in file.inputs] == [(1, 3, None, None)]
    assert [len(port.shape) for port in file.outputs] == [3]
    assert {"Conv", "Relu", "Cast"} <= file.operators
    assert file.premature == ""


def test_agrees_with_the_package_of_the_format(tmp_path: Path):
    onnx, networks = pytest.importorskip("onnx"), pytest.importorskip("tests.networks")
    path = tmp_path / "network.onnx"
    networks.convolving(path, 7, {"names": "{0: 'cone', 1: 'größe'}", "license": "Apache-2.0"})
    file, model = read_onnx_file(path), onnx.load(str(path))
    assert file.metadata == {entry.key: entry.value for entry in model.metadata_props}
    assert file.operators == {node.op_type for node in model.graph.node}
    assert file.inputs == (Port("picture", (1, 3, None, None)),)
    assert file.outputs == (Port("output0", (1, 7, None)),)
    assert names_in_metadata(file.metadata) == ("cone", "größe")


def test_weights_that_old_exporters_list_as_inputs_are_none(tmp_path: Path):
    onnx, networks = pytest.importorskip("onnx"), pytest.importorskip("tests.networks")
    path = tmp_path / "network.onnx"
    networks.answering(path, {"output0": np.zeros((1, 3, 4))})
    model = onnx.load(str(path))
    for tensor in model.graph.initializer:
        value = onnx.helper.make_tensor_value_info(tensor.name, tensor.data_type, tensor.dims)
        model.graph.input.append(value)
    onnx.save(model, str(path))
    assert [port.name for port in read_onnx_file(path).inputs] == ["picture"]


@pytest.mark.parametrize("left", [0, 10, 1000, 0.5, 0.999])
def test_a_file_cut_short_is_refused(tmp_path: Path, left: float):
    data = default_weights.read_bytes()
    path = tmp_path / "cut.onnx"
    path.write_bytes(data[: int(left * len(data)) if left < 1 else int(left)])
    with pytest.raises(DetectorFileError, match="not a whole ONNX file"):
        read_onnx_file(path)


@pytest.mark.parametrize("data", [b"not a network", b"\xff" * 40, b'{"json": 1}', bytes(100)])
def test_other_files_are_refused(tmp_path: Path, data: bytes):
    path = tmp_path / "other.onnx"
    path.write_bytes(data)
    with pytest.raises(DetectorFileError, match="not a whole ONNX file"):
        read_onnx_file(path)


def test_a_file_that_is_not_there_is_said(tmp_path: Path):
    with pytest.raises(DetectorFileError, match="No such file"):
        read_onnx_file(tmp_path / "none.onnx")


def test_names_may_be_a_dict_a_list_or_nonsense():
    assert names_in_metadata({"names": "{1: 'b', 0: 'a'}"}) == ("a", "b")
    assert names_in_metadata({"names": "['a', 'b']"}) == ("a", "b")
    assert names_in_metadata({"names": "__import__('os')"}) == ()
    assert names_in_metadata({}) == ()
