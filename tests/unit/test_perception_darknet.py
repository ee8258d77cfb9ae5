"""Darknet files become ONNX files that answer as Darknet's arithmetic says."""

from pathlib import Path

import numpy as np
import pytest
from numpy.lib.stride_tricks import sliding_window_view

pytest.importorskip("onnx")

from services.perception.detection.detector import Detector, Network
from services.perception.errors import DetectorFileError
from services.perception.training.darknet.convert import convert, main

SIDE, CLASSES = 64, 2
ANCHORS = np.array([[6, 8], [12, 20], [25, 18], [30, 40], [45, 30], [60, 60]], float)
YOLO = f"""[yolo]
mask={{mask}}
anchors={",".join(f"{x:g},{y:g}" for x, y in ANCHORS)}
classes={CLASSES}
scale_x_y={{stretch}}
"""
CFG = f"""# a little of everything
[net]
width={SIDE}
height={SIDE}
channels=3

[convolutional]
batch_normalize=1
filters=8
size=3
stride=4
pad=1
activation=leaky

[convolutional]
batch_normalize=1
filters=8
size=3
stride=4   # 4 x 4 cells of 16 px
pad=1
activation=mish

[maxpool]
size=2
stride=1

[route]
layers=-1
groups=2
group_id=1

[convolutional]
filters=4
size=1
stride=1
pad=1
activation=swish

[shortcut]
from=-2
activation=linear

[maxpool]
size=2
stride=2

[convolutional]
filters=21
size=1
stride=1
pad=1
activation=linear

{YOLO.format(mask="3,4,5", stretch=1)}
[route]
layers=-3

[upsample]
stride=2

[route]
layers=-1,1

[convolutional]
filters=21
size=1
stride=1
pad=1
activation=linear

{YOLO.format(mask="0,1,2", stretch=1.05)}"""


class Weights:
    """Random weights in the order of the file, and what they mean."""

    def __init__(self) -> None:
        self.rng = np.random.default_rng(0)
        self.row: list[np.ndarray] = []
        self.layers = [
            self._layer(8, 3, 3, normalised=True),
            self._layer(8, 8, 3, normalised=True),
            self._layer(4, 4, 1),
            self._layer(21, 4, 1),
            self._layer(21, 12, 1),
        ]

    def _layer(self, filters: int, channels: int, size: int, normalised: bool = False):
        bias, scale, mean = self.rng.normal(size=(3, filters)) * 0.3
        variance = self.rng.uniform(0.5, 2, filters)
        kernel = self.rng.normal(size=(filters, channels, size, size)) * 0.4
        norm = [scale, mean, variance] if normalised else []
        self.row += [bias, *norm, kernel.reshape(-1)]
        return kernel, bias, norm

    def write(self, path: Path, values: int | None = None) -> None:
        row = np.concatenate(self.row).astype("<f4")[:values]
        head = np.array([0, 2, 5], "<i4").tobytes() + np.array([99], "<i8").tobytes()
        path.write_bytes(head + row.tobytes())


def convolved(x: np.ndarray, layer, stride: int = 1) -> np.ndarray:
    kernel, bias, norm = layer
    pad = kernel.shape[2] // 2
    windows = sliding_window_view(
        np.pad(x, ((0, 0), (pad, pad), (pad, pad))), kernel.shape[2:], (1, 2)
    )
    y = np.einsum("chwyx,fcyx->fhw", windows[:, ::stride, ::stride], kernel)
    if norm:
        scale, mean, variance = (column[:, None, None] for column in norm)
        y = scale * (y - mean) / np.sqrt(variance + 1e-5)
    return y + bias[:, None, None]


def pooled(x: np.ndarray, stride: int) -> np.ndarray:
    """Windows of two that reach over the lower and right edges."""
    padded = np.pad(x, ((0, 0), (0, 1), (0, 1)), constant_values=-np.inf)
    return sliding_window_view(padded, (2, 2), (1, 2)).max((3, 4))[:, ::stride, ::stride]


def sigmoid(x: np.ndarray) -> np.ndarray:
    return 1 / (1 + np.exp(-x))


def boxes(x: np.ndarray, anchors: np.ndarray, stretch: float) -> np.ndarray:
    rows = []
    for anchor, part in zip(anchors, x.reshape(3, 5 + CLASSES, *x.shape[1:]), strict=True):
        for row in range(x.shape[1]):
            for column in range(x.shape[2]):
                cell, stride = part[:, row, column], SIDE / x.shape[1]
                middle = stretch * sigmoid(cell[:2]) - (stretch - 1) / 2 + [column, row]
                sides = np.exp(cell[2:4]) * anchor
                rows.append(np.concatenate([middle * stride, sides, sigmoid(cell[4:])]))
    return np.array(rows)


def reference(picture: np.ndarray, weights: Weights) -> np.ndarray:
    first, second, third, coarse_head, fine_head = weights.layers
    x = convolved(picture, first, 4)
    x = convolved(np.where(x > 0, x, 0.1 * x), second, 4)
    skipped = x * np.tanh(np.log1p(np.exp(x)))
    x = pooled(skipped, 1)[4:]
    inner = convolved(x, third)
    x = pooled(x + inner * sigmoid(inner), 2)
    coarse = convolved(x, coarse_head)
    doubled = x.repeat(2, axis=1).repeat(2, axis=2)
    fine = convolved(np.concatenate([doubled, skipped]), fine_head)
    return np.concatenate([boxes(coarse, ANCHORS[3:], 1.0), boxes(fine, ANCHORS[:3], 1.05)])


@pytest.fixture
def files(tmp_path: Path) -> tuple[Path, Path, Path]:
    cfg, weights, out = (tmp_path / name for name in ("a.cfg", "a.weights", "a.onnx"))
    cfg.write_text(CFG)
    Weights().write(weights)
    return cfg, weights, out


def test_opencv_answers_as_the_arithmetic_says(files, tmp_path: Path):
    names = tmp_path / "a.names"
    names.write_text("cone\nhydrant\n")
    convert(*files, names, "public domain")
    picture = np.random.default_rng(1).random((3, SIDE, SIDE)).astype(np.float32)
    (found,) = Network(files[2])(picture[None])
    np.testing.assert_allclose(found[0], reference(picture, Weights()), rtol=1e-3, atol=1e-3)


def test_the_converted_file_is_a_detector(files, tmp_path: Path):
    names = tmp_path / "a.names"
    names.write_text("cone\nhydrant\n")
    convert(*files, names, "public domain")
    detector = Detector(files[2], threshold=1e-6)
    assert detector.classes == ("cone", "hydrant")
    assert "objectness, three boxes a cell" in detector.description
    assert "stretch" in detector.description
    assert "licence: public domain" in detector.description
    picture = np.random.default_rng(1).integers(0, 255, (50, 200, 3)).astype(np.uint8)
    found = detector.detect(picture)
    assert len(found.scores)
    assert (found.corners_px <= [200, 50, 200, 50]).all()


@pytest.mark.parametrize(("cut", "told"), [(-5, "too few"), (5, None)])
def test_weights_of_another_network_are_refused(files, cut: int, told: str | None):
    weights = Weights()
    if cut > 0:
        weights.row.append(np.zeros(cut))
    weights.write(files[1], cut if cut < 0 else None)
    with pytest.raises(DetectorFileError, match=told or "not of one network"):
        convert(*files)


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("[upsample]", "[reorg]", r"\[reorg\]; known are"),
        ("activation=mish", "activation=maxout", "maxout"),
        ("[net]", "[region]", "does not begin with"),
        ("[yolo]", "[dropout]", r"\[dropout\]"),
    ],
)
def test_what_is_not_known_is_refused(files, old: str, new: str, told: str):
    files[0].write_text(CFG.replace(old, new))
    with pytest.raises(DetectorFileError, match=told):
        convert(*files)


def test_from_the_command_line(files, monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["darknet", *map(str, files)])
    assert main() == 0
    assert files[2].is_file()
    files[1].write_bytes(b"short")
    assert main() == 2
    assert "holds no Darknet weights" in capsys.readouterr().err
