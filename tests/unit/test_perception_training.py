# ruff: noqa: E402
"""The parts of training that need torch, which is not always installed."""

from pathlib import Path

import numpy as np
import pytest

torch = pytest.importorskip("torch")
onnx = pytest.importorskip("onnx")

from services.perception.detector import Network
from services.perception.picture import input_height, input_width, network_input
from services.perception.training.assignment import assign, corners
from services.perception.training.export import export_network
from services.perception.training.frames import Frame
from services.perception.training.loop import Training, learning_rate, targets_of
from services.perception.training.loss import generalised_overlap
from services.perception.training.network import (
    DecodedNetwork,
    DetectorNetwork,
    cell_grid,
    decode_boxes,
)
from tests.unit.test_perception_frames import striped_frame

torch.set_num_threads(1)


def perfect(targets, centers, sizes):
    """Raw predictions whose every cell draws the first object of its picture."""
    box = targets.boxes[:, :1]
    middle, size = (box[..., :2] + box[..., 2:]) / 2, box[..., 2:] - box[..., :2]
    raw = torch.zeros(len(box), len(centers), 8)
    raw[..., :2], raw[..., 2:4] = (middle - centers) / sizes, torch.log(size / sizes)
    raw[..., 5] = 4.0
    drawn = decode_boxes(raw, centers, sizes)
    np.testing.assert_allclose(drawn[0, 7, :2], middle[0, 0], rtol=1e-4)
    return raw


def test_cells_that_answer_lie_near_their_object():
    frames = [striped_frame(0), Frame(np.zeros((240, 320, 3)), np.zeros((0, 4)), np.zeros(0, int))]
    targets = targets_of(frames, torch.device("cpu"))
    centers, sizes = cell_grid(input_height, input_width)
    raw = perfect(targets, centers, sizes)
    boxes = corners(decode_boxes(raw, centers, sizes))
    found = assign(boxes, raw[..., 4:], targets, centers, sizes)
    assert set(found.picture.tolist()) == {0}
    assert set(found.target.tolist()) == {0, 1}
    assert len(set(found.cell.tolist())) == len(found.cell)
    wanted = targets.boxes[found.picture, found.target]
    middles = (wanted[:, :2] + wanted[:, 2:]) / 2
    assert ((centers[found.cell] - middles).abs() < 2.5 * sizes[found.cell]).all()
    np.testing.assert_allclose(found.overlap[found.target == 0], 1.0, atol=1e-4)
    # Only one drawing fits the second object at all, so it gets a single cell.
    assert (found.target == 0).sum() == 10
    assert (found.target == 1).sum() == 1


def test_generalised_overlap_tells_near_from_far():
    box = torch.tensor([[0.0, 0.0, 10.0, 10.0]]).repeat(3, 1)
    other = box + torch.tensor([[0.0], [20.0], [200.0]])
    same, near, far = generalised_overlap(box, other).tolist()
    assert same == pytest.approx(1.0)
    assert -1 < far < near < 0


def test_pictures_without_objects_have_a_finite_loss():
    empty = Frame(np.zeros((240, 320, 3), np.uint8), np.zeros((0, 4)), np.zeros(0, int))
    assert np.isfinite(Training(2, 0).step([empty, empty], 100))


def test_loss_falls_and_a_checkpoint_continues_exactly(tmp_path: Path):
    frames = [striped_frame(seed) for seed in range(2)]
    training = Training(2, seed=0)
    training.pictures_seen = 3000  # past the slow first steps
    losses = [training.step(frames, 40_000) for _ in range(8)]
    assert losses[-1] < 0.8 * losses[0]
    training.save(tmp_path / "checkpoint.pt")
    again = Training(2, seed=1)
    again.load(tmp_path / "checkpoint.pt")
    assert again.pictures_seen == training.pictures_seen
    assert again.step(frames, 40_000) == pytest.approx(training.step(frames, 40_000), rel=1e-5)
    assert again.rng.random() == training.rng.random()


def test_learning_rate_rises_then_falls():
    rates = [learning_rate(seen, 50_000) for seen in range(0, 60_000, 500)]
    peak = int(np.argmax(rates))
    assert 0 < peak < 12
    assert (np.diff(rates[:peak]) > 0).all()
    assert (np.diff(rates[peak:]) <= 0).all()


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_exported_file_predicts_what_the_network_does(tmp_path: Path):
    torch.manual_seed(0)
    network = DetectorNetwork(classes=3).eval()
    path = tmp_path / "detector.onnx"
    export_network(network, path)
    blob = network_input(striped_frame().color)
    with torch.no_grad():
        expected = DecodedNetwork(network, input_height, input_width)(torch.from_numpy(blob))
    (found,) = Network(path)(blob)
    np.testing.assert_allclose(found, expected, rtol=2e-2, atol=0.05)
    halved = {tensor.data_type for tensor in onnx.load(str(path)).graph.initializer}
    assert onnx.TensorProto.FLOAT16 in halved
    assert path.stat().st_size < 1.5e6
