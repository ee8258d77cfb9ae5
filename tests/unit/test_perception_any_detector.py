# ruff: noqa: E402
"""Networks of other makes, written in each test and run through OpenCV."""

import json
from pathlib import Path

import numpy as np
import pytest

onnx = pytest.importorskip("onnx")

from services.cli import main
from services.perception.detection.detector import Detector
from services.perception.detection.layouts import cell_grid
from services.perception.drawing import write_png
from services.perception.errors import DetectorFileError, PerceptionError
from tests.networks import answering, convolving, save

WIDTH, HEIGHT = 128, 96
CELLS = 16 * 12 + 8 * 6 + 4 * 3
RED = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
RED[..., 0] = 255


def table(*boxes: tuple[float, ...], columns: int, count: int = CELLS) -> np.ndarray:
    """Rows (1, N, columns) that are nothing, but for those given."""
    answer = np.zeros((1, count, columns), np.float32)
    answer[0, :, :4] = 5.0
    for index, box in enumerate(boxes):
        answer[0, 7 * index + 3, : len(box)] = box
    return answer


def names(folder: Path, *classes: str) -> Path:
    path = folder / "classes.txt"
    path.write_text("\n".join(classes) + "\n")
    return path


def test_class_scores_of_an_export_that_says_its_names(tmp_path: Path):
    path = tmp_path / "anything.onnx"
    rows = table((40, 30, 20, 10, 0.9, 0.1), (80, 50, 10, 30, 0.2, 0.6), columns=6)
    noted = {"names": "{0: 'cone', 1: 'hydrant'}", "license": "AGPL-3.0 License", "task": "detect"}
    answering(path, {"output0": rows.transpose(0, 2, 1)}, metadata=noted)
    detector = Detector(path)
    found = detector.detect(RED)
    assert detector.classes == ("cone", "hydrant")
    np.testing.assert_allclose(found.corners_px, [[30, 25, 50, 35], [75, 35, 85, 65]], atol=1e-3)
    np.testing.assert_allclose(found.scores, [0.9, 0.6], rtol=1e-6)
    assert found.classes.tolist() == [0, 1]
    assert (found.probabilities.sum(axis=1) <= 1).all()
    assert "AGPL-3.0 License" in detector.description
    assert "class_scores" in detector.description


def test_look_shows_what_other_networks_find(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    pictures = tmp_path / "pictures"
    pictures.mkdir()
    assert write_png(str(pictures / "0.png"), RED)
    for name, box in (("a", (40, 30, 20, 10, 0.9, 0.1)), ("b", (80, 50, 10, 30, 0.2, 0.6))):
        rows = table(box, columns=6).transpose(0, 2, 1)
        answering(tmp_path / f"{name}.onnx", {"output0": rows})
    lists = [str(names(tmp_path, "mug", "lamp"))] * 2
    files = [str(tmp_path / name) for name in ("a.onnx", "b.onnx")]
    arguments = ["look", "--camera", str(pictures), "--detector", *files, "--classes", *lists]
    assert main([*arguments, "--json"]) == 0
    told = capsys.readouterr()
    (frame,) = json.loads(told.out)["frames"]
    assert {one["class"] for one in frame["objects"]} == {"mug", "lamp"}
    assert all(file in told.err for file in files)


def test_what_is_no_number_or_beside_the_picture_is_no_box(tmp_path: Path):
    path = tmp_path / "network.onnx"
    rows = table(
        (float("nan"), 30, 20, 10, 0.9, 0.1),
        (40, -60, 20, 10, 0.9, 0.1),
        (2, 50, 20, 10, 0.8, 0.1),
        columns=6,
    )
    answering(path, {"output0": rows}, metadata={"names": "['a', 'b']"})
    found = Detector(path).detect(RED)
    np.testing.assert_allclose(found.corners_px, [[0, 45, 12, 55]], atol=1e-3)


@pytest.mark.parametrize(
    ("columns", "count", "color", "scale"),
    [(6, CELLS, "rgb", 1 / 255), (7, 3 * CELLS, "rgb", 1 / 255), (7, CELLS, "bgr", 1.0)],
)
def test_each_family_is_shown_what_it_was_trained_on(
    tmp_path: Path, columns: int, count: int, color: str, scale: float
):
    """A score that depends on the channel means tells colour order and scale."""
    path = tmp_path / "network.onnx"
    rows = table(columns=columns, count=count)
    if color == "bgr":
        rows[0, :, :2] = cell_grid((8, 16, 32), WIDTH, HEIGHT)[0] + 4
    rows[0, :, 4:] = 0.1
    rows[0, 5, 4:] = 0.7
    weights = answering(path, {"o": rows}, swing=1e-3 if scale < 1 else 1e-5)["o"]
    found = Detector(path, names(tmp_path, "a", "b")).detect(RED)
    shown = np.array([255.0, 0, 0])[:: 1 if color == "rgb" else -1] * scale
    answer = rows[0] + np.einsum("c,c...->...", shown, weights)[0]
    scores = answer[5, 4] * answer[5, 5:].max() if columns == 7 else answer[5, 4:].max()
    assert found.scores[0] == pytest.approx(scores, abs=1e-6)


@pytest.mark.parametrize("size", [(128, 96), (320, 240), (64, 200), (131, 77)])
def test_boxes_come_back_to_the_picture_through_the_letterbox(tmp_path: Path, size):
    path = tmp_path / "dynamic.onnx"
    convolving(path, 6, {"names": "['a', 'b']", "imgsz": "[128, 128]"})
    width, height = size
    shrunk = min(1.0, 128 / max(size))
    shown = [32 * -int(-side * shrunk // 32) for side in size]
    scale = min(shown[0] / width, shown[1] / height)
    x, y = ((side - round(own * scale)) // 2 for side, own in zip(shown, size, strict=True))
    expected = [(15 - x) / scale, (15 - y) / scale, (25 - x) / scale, (25 - y) / scale]
    found = Detector(path, threshold=1e-6).detect(np.full((height, width, 3), 80, np.uint8))
    np.testing.assert_allclose(found.corners_px[0], expected, atol=1e-3)


def test_a_dynamic_export_is_run_at_the_size_of_the_picture(tmp_path: Path):
    path = tmp_path / "dynamic.onnx"
    kernels = convolving(path, 6, {"names": "['a', 'b']"})
    picture = np.random.default_rng(2).integers(0, 255, (64, 96, 3)).astype(np.uint8)
    detector = Detector(path, threshold=1e-6)
    blob = picture.transpose(2, 0, 1) / 255
    best = max(
        np.einsum("kcyx,cyx->k", kernel, blob[:, y : y + stride, x : x + stride])[4:].max()
        for kernel, stride in zip(kernels, (8, 16, 32), strict=True)
        for y in range(0, 64, stride)
        for x in range(0, 96, stride)
    )
    assert detector.detect(picture).scores[0] == pytest.approx(best, rel=1e-4)
    assert "any size" in detector.description


def test_end_to_end_boxes_may_overlap_since_the_network_chose_them(tmp_path: Path):
    path = tmp_path / "network.onnx"
    rows = np.zeros((1, 30, 6), np.float32)
    rows[0, 0], rows[0, 1] = [10, 10, 50, 50, 0.9, 1], [12, 10, 50, 50, 0.8, 1]
    answering(path, {"output0": rows}, metadata={"names": "['a', 'b']", "end2end": "True"})
    found = Detector(path).detect(RED)
    np.testing.assert_allclose(found.scores, [0.9, 0.8])
    assert found.classes.tolist() == [1, 1]


def test_raw_maps_of_several_strides(tmp_path: Path):
    path = tmp_path / "network.onnx"
    maps = {f"p{s}": np.full((1, 7, HEIGHT // s, WIDTH // s), -9.0) for s in (8, 16, 32)}
    for part in maps.values():
        part[0, :4] = 0.0
    maps["p16"][0, :, 2, 5] = [0.5, 0.25, np.log(2), 0.0, 4.0, 5.0, -4.0]
    answering(path, maps)
    found = Detector(path, names(tmp_path, "a", "b")).detect(RED)
    x, y = (5 + 0.5) * 16, (2 + 0.25) * 16
    np.testing.assert_allclose(found.corners_px, [[x - 16, y - 8, x + 16, y + 8]], atol=1e-3)
    expected = 1 / (1 + np.exp(-4)) / (1 + np.exp(-5))
    assert found.scores[0] == pytest.approx(expected, rel=1e-5)


def test_shares_of_the_picture_are_stretched_with_it(tmp_path: Path):
    path = tmp_path / "network.onnx"
    boxes, scores = np.zeros((1, 9, 1, 4)), np.zeros((1, 9, 2))
    boxes[0, 4, 0], scores[0, 4] = [0.25, 0.5, 0.75, 1.0], [0.1, 0.7]
    answering(path, {"boxes": boxes, "confs": scores})
    found = Detector(path, names(tmp_path, "a", "b")).detect(np.full((50, 200, 3), 80, np.uint8))
    np.testing.assert_allclose(found.corners_px, [[50, 25, 150, 50]], atol=1e-3)
    assert found.scores[0] == pytest.approx(0.7)


def test_the_file_beside_it_goes_before_what_is_usual(tmp_path: Path):
    path = tmp_path / "network.onnx"
    rows = table((40, 30, 20, 10, 0.9, 0.1), columns=6)
    answering(path, {"output0": rows})
    said = {"classes": ["cone", "box"], "placement": "stretch", "licence": "mine", "threshold": 0.5}
    path.with_suffix(".json").write_text(json.dumps(said))
    detector = Detector(path)
    found = detector.detect(np.full((192, 128, 3), 80, np.uint8))
    assert detector.classes == ("cone", "box")
    assert detector.threshold == 0.5
    np.testing.assert_allclose(found.corners_px, [[30, 50, 50, 70]], atol=1e-3)
    assert "licence: mine" in detector.description
    assert "stretch" in detector.description


@pytest.mark.parametrize(
    ("said", "told"),
    [
        ({"colour": "rgb"}, "colour"),
        ({"color": "grey"}, "grey"),
        ({"width": 3}, "width"),
        ({"width": 640}, "width is 640"),
        ({"layout": "maps"}, "said to be of layout maps"),
        ({"classes": ["a"]}, "names 1"),
    ],
)
def test_a_file_beside_it_that_is_wrong_is_refused(tmp_path: Path, said: dict, told: str):
    path = tmp_path / "network.onnx"
    answering(path, {"o": table(columns=6)}, metadata={"names": "['a', 'b']"})
    path.with_suffix(".json").write_text(json.dumps(said))
    with pytest.raises(DetectorFileError, match=told):
        Detector(path)


def test_classes_that_do_not_match_are_refused_with_both_numbers(tmp_path: Path):
    path = tmp_path / "network.onnx"
    answering(path, {"o": table(columns=9)})
    with pytest.raises(DetectorFileError, match=r"2 class names .* room for 4"):
        Detector(path, names(tmp_path, "a", "b"))
    with pytest.raises(DetectorFileError, match="--classes FILE"):
        Detector(path)


@pytest.mark.parametrize(
    ("text", "told"),
    [("", "names no class"), ("a\n\nb\n", "name 2 of 3 is empty"), ('["a", 3]', "JSON list")],
)
def test_class_files_that_are_malformed_are_refused(tmp_path: Path, text: str, told: str):
    path = tmp_path / "network.onnx"
    answering(path, {"o": table(columns=6)})
    (tmp_path / "classes.txt").write_text(text)
    with pytest.raises(DetectorFileError, match=told):
        Detector(path, tmp_path / "classes.txt")


def test_a_json_list_of_classes_is_read(tmp_path: Path):
    path = tmp_path / "network.onnx"
    answering(path, {"o": table(columns=6)})
    (tmp_path / "classes.json").write_text('["traffic cone", "größe"]')
    assert Detector(path, tmp_path / "classes.json").classes == ("traffic cone", "größe")


def node(operator: str, *ends: str, **attributes):
    return onnx.helper.make_node(operator, list(ends[:-1]), [ends[-1]], **attributes)


def broken(path: Path, nodes: list, shape=(1, 3, HEIGHT, WIDTH), metadata=None) -> Path:
    zero = onnx.numpy_helper.from_array(np.zeros((), np.float32), "zero")
    save(path, nodes, [zero], shape, {"output0": (1, 3, "h", "w")}, metadata)
    return path


def test_an_export_in_half_precision_with_its_nodes_out_of_order_is_refused(tmp_path: Path):
    nodes = [node("Relu", "cast", "output0"), node("Cast", "picture", "cast", to=1)]
    path = broken(tmp_path / "half.onnx", nodes)
    with pytest.raises(DetectorFileError, match="half=False"):
        Detector(path, names(tmp_path, "a"))


def test_whole_numbers_are_refused(tmp_path: Path):
    nodes = [node("DynamicQuantizeLinear", "picture", "q"), node("Relu", "picture", "output0")]
    nodes[0].output.extend(["s", "z"])
    path = broken(tmp_path / "int8.onnx", nodes)
    with pytest.raises(DetectorFileError, match="INT8"):
        Detector(path, names(tmp_path, "a"))


@pytest.mark.parametrize("shape", [(1, HEIGHT, WIDTH, 3), (4, 3, HEIGHT, WIDTH), (1, 3)])
def test_other_inputs_are_refused(tmp_path: Path, shape: tuple[int, ...]):
    path = broken(tmp_path / "input.onnx", [node("Relu", "picture", "output0")], shape)
    with pytest.raises(DetectorFileError, match=r"\(1, 3, H, W\)"):
        Detector(path, names(tmp_path, "a"))


def test_operators_that_opencv_does_not_know_are_refused(tmp_path: Path):
    path = broken(tmp_path / "empty.onnx", [node("Unheard", "picture", "output0", domain="ours")])
    with pytest.raises(DetectorFileError, match="cannot load"):
        Detector(path, names(tmp_path, "a"))


def test_other_outputs_are_refused_with_their_shape(tmp_path: Path):
    path = broken(tmp_path / "picture.onnx", [node("Relu", "picture", "output0")])
    with pytest.raises(DetectorFileError, match=r"\(1, 3, 96, 128\).*known are"):
        Detector(path, names(tmp_path, "a"))


def test_one_free_side_must_be_said(tmp_path: Path):
    path = broken(tmp_path / "half.onnx", [node("Relu", "picture", "output0")], (1, 3, "h", 128))
    with pytest.raises(DetectorFileError, match=r"say both in half\.json"):
        Detector(path, names(tmp_path, "a"))


def test_other_tasks_are_refused(tmp_path: Path):
    path = tmp_path / "turned.onnx"
    answering(path, {"o": table(columns=6)}, metadata={"names": "['a', 'b']", "task": "obb"})
    with pytest.raises(PerceptionError, match="obb"):
        Detector(path)
