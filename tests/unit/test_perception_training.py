# ruff: noqa: E402
"""The parts of training that need torch, which is not always installed."""

from pathlib import Path

import numpy as np
import pytest

torch = pytest.importorskip("torch")
onnx = pytest.importorskip("onnx")

from services.perception.detection.detector import Network
from services.perception.detection.layouts import Layout, Question, recognised
from services.perception.detection.picture import input_height, input_width, network_input
from services.perception.errors import DetectorFileError
from services.perception.training.detector.assignment import Targets, assign, unjudged
from services.perception.training.detector.export import export_network
from services.perception.training.detector.frames import Frame
from services.perception.training.detector.geometry import complete_overlap, overlaps
from services.perception.training.detector.loop import (
    Progress,
    Stage,
    Training,
    learning_rate,
    targets_of,
)
from services.perception.training.detector.loss import detection_loss
from services.perception.training.detector.network import (
    DecodedNetwork,
    DetectorNetwork,
    bins,
    cell_grid,
    decode_corners,
    split,
)
from services.perception.training.detector.widening import widen
from tests.unit.test_perception_frames import empty_frame, half_ignored, striped_frame

torch.set_num_threads(1)
GRID = cell_grid(input_height, input_width)
CLASSES = ("left", "right")


def targets(*frames: Frame) -> Targets:
    return targets_of(list(frames), torch.device("cpu"))


def drawing(found: Targets) -> torch.Tensor:
    """Raw predictions whose every cell draws the first object of its picture, as its class."""
    box = found.boxes[:, :1]
    ends = torch.cat([GRID.centers - box[..., :2], box[..., 2:] - GRID.centers], -1) / GRID.sizes
    distances = torch.full((*ends.shape, bins), -30.0)
    low = ends.clamp(0, bins - 1.01).long()
    upper = (ends.clamp(0, bins - 1.01) - low).clamp(1e-6, 1 - 1e-6)
    distances.scatter_(-1, low[..., None], torch.log(1 - upper)[..., None])
    distances.scatter_(-1, low[..., None] + 1, torch.log(upper)[..., None])
    scores = torch.full((*ends.shape[:2], len(CLASSES)), -6.0)
    scores[..., 0] = 6.0
    return torch.cat([distances.flatten(2), scores], -1)


def test_distances_are_read_back_as_boxes():
    found = targets(striped_frame())
    boxes = decode_corners(split(drawing(found))[0], GRID)
    inside = ((GRID.centers > found.boxes[0, 0, :2]) & (GRID.centers < found.boxes[0, 0, 2:])).all(
        -1
    )
    expected = found.boxes[0, :1].expand(int(inside.sum()), 4)
    np.testing.assert_allclose(boxes[0, inside], expected, atol=0.1)


def test_cells_that_answer_lie_in_their_object_and_the_best_is_asked_for_most():
    found_objects = targets(striped_frame(0), empty_frame())
    raw = drawing(found_objects)
    boxes = decode_corners(split(raw)[0], GRID)
    found = assign(boxes, split(raw)[1].sigmoid(), found_objects, GRID.centers, GRID.sizes)
    assert set(found.picture.tolist()) == {0}
    assert set(found.target.tolist()) == {0, 1}
    assert len(set(found.cell.tolist())) == len(found.cell)
    wanted = found_objects.boxes[found.picture, found.target]
    centers = GRID.centers[found.cell]
    assert ((centers > wanted[:, :2]) & (centers < wanted[:, 2:])).all()
    assert (found.target == 0).sum() == 10
    assert found.score[found.target == 0].max() == pytest.approx(1.0, abs=1e-2)
    # What is drawn where the second object is fits it badly.
    assert (found.score[found.target == 1] < 0.6).all()


def test_objects_that_nothing_overlaps_are_taken_by_their_nearest_cells():
    found_objects = targets(striped_frame(0))
    nowhere = torch.cat([GRID.centers, GRID.centers], -1)[None]
    scores = torch.full((1, len(GRID.centers), len(CLASSES)), 0.5)
    found = assign(nowhere, scores, found_objects, GRID.centers, GRID.sizes)
    assert found.target.tolist() == [0, 0, 0, 1, 1, 1]
    assert (found.score == 0).all()
    middles = (found_objects.boxes[0, :, :2] + found_objects.boxes[0, :, 2:]) / 2
    assert ((GRID.centers[found.cell] - middles[found.target]).abs() < 8).all()


def test_ignored_objects_teach_nothing_and_nobody():
    frame = striped_frame()
    found_objects = targets(half_ignored(frame))
    raw = drawing(found_objects)
    found = assign(
        decode_corners(split(raw)[0], GRID),
        split(raw)[1].sigmoid(),
        found_objects,
        GRID.centers,
        GRID.sizes,
    )
    assert set(found.target.tolist()) == {0}
    free = unjudged(found_objects, GRID.centers, GRID.sizes)[0]
    low, high = found_objects.boxes[0, 1, :2], found_objects.boxes[0, 1, 2:]
    assert free[((GRID.centers > low) & (GRID.centers < high)).all(-1)].all()
    apart = ((GRID.centers < low - 40) | (GRID.centers > high + 40)).any(-1)
    assert not free[apart].any()
    # What is said there changes nothing.
    shouting = raw.clone()
    shouting[0, free, -1] = 9.0
    before = detection_loss(raw, found_objects, GRID)
    assert detection_loss(shouting, found_objects, GRID) == pytest.approx(float(before), rel=1e-5)


def test_complete_overlap_tells_near_from_far_and_flat_from_tall():
    box = torch.tensor([[0.0, 0.0, 10.0, 10.0]]).repeat(3, 1)
    other = box + torch.tensor([[0.0], [20.0], [200.0]])
    same, near, far = complete_overlap(box, other).tolist()
    assert same == pytest.approx(1.0)
    assert -2 < far < near < 0
    flat = torch.tensor([[0.0, 0.0, 20.0, 5.0]])
    assert complete_overlap(flat, box[:1]) < overlaps(flat, box[:1])


def test_pictures_without_objects_have_a_finite_loss():
    assert np.isfinite(Training(CLASSES, 0).step([empty_frame(), empty_frame()], 100))


def test_loss_falls_and_a_checkpoint_continues_exactly(tmp_path: Path):
    frames = [striped_frame(seed) for seed in range(2)]
    training = Training(CLASSES, seed=0)
    training.pictures_seen = 3000  # past the slow first steps
    losses = [training.step(frames, 40_000) for _ in range(10)]
    assert losses[-1] < 0.8 * losses[0]
    training.save(tmp_path / "checkpoint.pt")
    again = Training(CLASSES, seed=1)
    again.load(tmp_path / "checkpoint.pt")
    assert again.pictures_seen == training.pictures_seen
    assert again.step(frames, 40_000) == pytest.approx(training.step(frames, 40_000), rel=1e-5)
    assert again.rng.random() == training.rng.random()


def test_a_checkpoint_of_other_classes_is_refused(tmp_path: Path):
    Training(CLASSES, seed=0).save(tmp_path / "checkpoint.pt")
    with pytest.raises(DetectorFileError, match="move it away"):
        Training(("up", "down"), seed=0).load(tmp_path / "checkpoint.pt")


STAGES = (Stage(12, 0.5, 2e-3), Stage(24, 0.5, 1e-3))


def test_a_wider_network_says_what_the_narrow_one_said():
    torch.manual_seed(3)
    narrow, wide = DetectorNetwork(3, 12), DetectorNetwork(3, 24)
    narrow.train()(torch.rand(2, 3, 64, 64))  # Norms that are not those of the start.
    widen(narrow, wide)
    pictures = torch.rand(2, 3, 64, 96)
    with torch.no_grad():
        said, before = wide.eval()(pictures), narrow.eval()(pictures)
    torch.testing.assert_close(said, before, rtol=1e-4, atol=1e-4)
    wide.train()(pictures).square().sum().backward()
    for head in wide.heads:
        # What was added is not listened to yet, but is heard.
        assert float(head.classes.weight.grad[:, 12:].abs().max()) > 0


def test_a_training_widens_in_the_middle_and_goes_on_from_there(tmp_path: Path):
    frames = [striped_frame(seed) for seed in range(2)]
    training = Training(CLASSES, 0, STAGES)
    for _ in range(6):
        loss = training.step(frames, 16)
    assert training.network.width == 24
    assert training.average.width == 24
    assert training.losses == []
    training.save(tmp_path / "checkpoint.pt")
    again = Training(CLASSES, 0, STAGES)
    again.load(tmp_path / "checkpoint.pt")
    assert again.network.width == 24
    assert np.isfinite(loss)
    assert again.step(frames, 16) == pytest.approx(training.step(frames, 16), rel=1e-5)


def test_every_picture_belongs_to_one_stage():
    stages = [Progress.after(seen, 100, STAGES) for seen in range(0, 120, 10)]
    assert [one.stage for one in stages] == [0] * 5 + [1] * 7
    assert [one.seen for one in stages[:10]] == [0, 10, 20, 30, 40] * 2


def test_learning_rate_rises_then_falls():
    rates = [learning_rate(seen, 50_000, 2e-3) for seen in range(0, 60_000, 500)]
    peak = int(np.argmax(rates))
    assert 0 < peak < 12
    assert (np.diff(rates[:peak]) > 0).all()
    assert (np.diff(rates[peak:]) <= 0).all()


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_exported_file_predicts_what_the_network_does(tmp_path: Path):
    torch.manual_seed(0)
    network = DetectorNetwork(classes=3, width=48).eval()
    path = tmp_path / "detector.onnx"
    export_network(network, path)
    blob = network_input(striped_frame().color)
    with torch.no_grad():
        expected = DecodedNetwork(network, input_height, input_width)(torch.from_numpy(blob))
    (found,) = Network(path)(blob)
    np.testing.assert_allclose(found, expected, rtol=2e-2, atol=0.05)
    question = Question(input_width, input_height, 3, more_channels=False, end_to_end=False)
    assert recognised([found], question).layout is Layout.CLASS_SCORES
    halved = {tensor.data_type for tensor in onnx.load(str(path)).graph.initializer}
    assert onnx.TensorProto.FLOAT16 in halved
    assert path.stat().st_size < 1.5e6
