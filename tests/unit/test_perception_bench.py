"""`bench perception`: what it makes of boxes, places and pictures whose truth is known."""

import json
from pathlib import Path

import cv2
import msgspec
import numpy as np
import pytest

from schemas.geometry import Pose2, Pose3
from schemas.perception import Detections
from schemas.sensing import Intrinsics, RgbdFrame
from services.cli import main
from services.perception.detection.boxes import Boxes
from services.perception.detection.calibration import calibration_error
from services.perception.places.card import PlacesCard
from services.perception.training.places.measurement import Looks, figures
from sim.experiments.perception.bench import ratio_of
from sim.experiments.perception.box_rows import box_rows, false_row, poisson_interval, working_rows
from sim.experiments.perception.boxes import BoxFigures, labelled
from sim.experiments.perception.cycle import sized
from sim.experiments.perception.frames import KnownFrame
from sim.experiments.perception.place_rows import judged_rows
from sim.experiments.perception.resampling import RESAMPLES, scene_interval, scene_weights
from sim.experiments.perception.space import Placings, joined, placings_in
from sim.experiments.perception.space_rows import ASKED_CM, ASKED_OF_RANGE, space_rows
from sim.experiments.report import Peer, Row
from sim.scenes.rooms import ROOM_KINDS

CLASSES = ("cone", "hydrant")
AHEAD = Pose3((0.2, 0.0, 1.0), (0.5, -0.5, 0.5, -0.5))
BOXES = np.array([[50, 60, 90, 140], [120, 60, 180, 140], [250, 60, 319.5, 140.0]])
LABELS = ("cone", "banana", "hydrant")
CENTERS = np.array([[2.2, 0.0, 0.3], [3.2, 0.0, 0.3], [5.2, -1.0, 0.4]])


def known(scene: int = 0, ignored: tuple[bool, ...] = (False,) * 3) -> KnownFrame:
    """A small cone, a banana, and a large hydrant that the right edge cuts."""
    rng = np.random.default_rng(scene)
    frame = RgbdFrame(
        stamp_ns=0,
        color=rng.integers(0, 255, (240, 320, 3), np.uint8),
        depth_mm=np.full((240, 320), 2000, np.uint16),
        intrinsics=Intrinsics(320, 240, 277.0, 277.0, 159.5, 119.5),
        base_from_camera=AHEAD,
        odom_from_base=Pose2(0.0, 0.0, 0.0),
    )
    sizes = np.array([[0.3, 0.3, 0.5], [0.2, 0.1, 0.1], [1.0, 1.0, 1.5]])
    return KnownFrame(scene, frame, BOXES, LABELS, np.array(ignored), CENTERS, sizes)


def boxes_of(corners: np.ndarray, rows: np.ndarray) -> Boxes:
    return Boxes(corners, rows.max(axis=1, initial=0.0), rows, rows)


def said(off: tuple[float, float, float], deviation: float, best: int = 0) -> Detections:
    """One detection on the cone, this far off."""
    rows = np.eye(2)[[best]]
    return Detections(
        stamp_ns=0,
        classes=CLASSES,
        odom_from_base=Pose2(0.0, 0.0, 0.0),
        boxes_px=BOXES[:1] + 1,
        probabilities=rows,
        scores=np.array([0.9]),
        centers_base=CENTERS[:1] + off,
        covariances=deviation**2 * np.eye(3)[None],
        extents=np.ones((1, 3)),
        view_bearings=np.zeros(0),
        view_ranges=np.zeros(0),
        view_near=0.5,
        picture_size=(320, 240),
        inference_ms=0.0,
    )


def test_classes_that_the_network_does_not_know_are_scenery():
    on_the_banana = boxes_of(BOXES[1:2], np.array([[0.9, 0.0]]))
    picture = labelled(on_the_banana, known(ignored=(False, False, True)), CLASSES)
    np.testing.assert_allclose(picture.true_boxes, BOXES[:1])
    assert picture.true_classes.tolist() == [0]
    np.testing.assert_allclose(picture.ignored_boxes, BOXES[2:])
    right, found = working_rows([picture])
    assert (right.ours, found.ours) == (0.0, 0.0)


def box_figures(shift: float, count: int = 12) -> BoxFigures:
    """Every object found in pictures of four scenes, boxes moved by this many pixels."""
    rows = np.array([[0.95, 0.0], [0.0, 0.95]])
    found = boxes_of(BOXES[[0, 2]] + shift, rows)
    pictures = [labelled(found, known(number // 3), CLASSES) for number in range(count)]
    return BoxFigures(CLASSES, pictures, np.arange(count) // 3)


def by_metric(rows: list[Row]) -> dict[tuple[str, str], Row]:
    return {(row.row, row.metric): row for row in rows}


def test_what_is_found_exactly_has_a_precision_of_one_and_what_is_beside_it_has_none():
    exact = by_metric(box_rows(box_figures(0.0), np.random.default_rng(0)))
    assert exact["detector, all 2 classes", "mAP50"].ours == pytest.approx(1.0)
    assert exact["detector, all 2 classes", "mAP50-95"].interval == pytest.approx((1.0, 1.0))
    assert exact["detector, probability of the class named", "calibration error"].ours < 0.051
    beside = by_metric(box_rows(box_figures(60.0), np.random.default_rng(0)))
    assert beside["detector, cone", "AP50"].ours == 0.0
    assert "missed" in beside["detector, all 2 classes", "mAP50"].asked_text
    moved = by_metric(box_rows(box_figures(4.0), np.random.default_rng(0)))
    assert 0.3 < moved["detector, all 2 classes", "mAP50-95"].ours < 1.0


def test_the_weighted_calibration_error_is_that_of_the_reliability_diagram():
    rng = np.random.default_rng(0)
    pictures = [
        labelled(
            boxes_of(BOXES + rng.uniform(-20, 20, (3, 1)), rng.uniform(0, 1, (3, 2))),
            known(number),
            CLASSES,
        )
        for number in range(40)
    ]
    claims = BoxFigures(CLASSES, pictures, np.arange(40)).claims
    assert len(claims.scores) > 50
    assert claims.calibration_error() == pytest.approx(calibration_error(claims.reliability))
    twice = np.full(40, 2.0)
    assert claims.calibration_error(twice) == pytest.approx(claims.calibration_error())


def test_pictures_of_one_scene_are_drawn_together():
    scenes = np.array([0, 0, 0, 4, 4, 7])
    weights = scene_weights(scenes, np.random.default_rng(0))
    assert weights.shape == (RESAMPLES, 6)
    assert (weights[:, [0, 3]] == weights[:, [2, 4]]).all()
    np.testing.assert_allclose(weights[:, [0, 3, 5]].sum(axis=1), 3)
    low, high = scene_interval(lambda weight: float(weight[5]), weights)
    assert (low, high) == (0, 3)


@pytest.mark.parametrize(("count", "low", "high"), [(0, 0.0, 3.689), (10, 4.795, 18.39)])
def test_the_interval_of_a_count_is_that_of_the_literature(count: int, low: float, high: float):
    assert poisson_interval(count) == pytest.approx((low, high), abs=1e-2)
    assert false_row(count, 200).interval == pytest.approx((low / 2, high / 2), abs=1e-2)


def test_a_place_is_judged_by_how_far_it_is_off_and_by_its_covariance():
    found = placings_in(4, known(), said((0.03, 0.0, 0.04), 0.05))
    assert found.placed.tolist() == [True, False]
    np.testing.assert_allclose(found.errors[0], 0.05)
    np.testing.assert_allclose(found.squared[0], 1.0)
    np.testing.assert_allclose(found.ranges[0], np.hypot(2.0, 0.7))
    assert found.small.tolist() == [True, False]
    assert found.whole.tolist() == [True, False]
    assert found.pictures.tolist() == [4, 4]


def test_another_name_or_an_ignored_object_is_no_place():
    assert not placings_in(0, known(), said((0, 0, 0), 0.1, best=1)).placed.any()
    nothing = placings_in(0, known(ignored=(True, True, True)), said((0, 0, 0), 0.1))
    assert len(nothing.ranges) == 0


def placings(error: float, count: int = 30) -> Placings:
    """Cones in pictures of their own, all this far off."""
    return joined(
        [placings_in(number, known(), said((error, 0, 0), 0.05)) for number in range(count)]
    )


def test_rows_of_a_band_say_what_is_asked_there():
    scenes = np.arange(30)
    rows = by_metric(space_rows(placings(0.04), scenes, np.random.default_rng(0)))
    band = "small things, 1.5 to 2.5 m"
    assert rows[band, "found and placed"].ours == 100.0
    assert rows[band, "centre error"].ours == pytest.approx(4.0)
    assert (rows[band, "centre error"].asked, ASKED_CM) == (5.0, 5.0)
    share = rows[band, "centre error by range"]
    assert share.ours == pytest.approx(100 * 0.04 / np.hypot(2.0, 0.7))
    assert share.asked == ASKED_OF_RANGE
    assert rows[band, "within the 95 % bound of its covariance"].ours == 100.0
    far = by_metric(space_rows(placings(0.2), scenes, np.random.default_rng(0)))
    assert "missed" in far[band, "centre error"].asked_text
    assert far[band, "within the 95 % bound of its covariance"].ours == 0.0


def test_more_pixels_look_in_the_same_directions():
    frame = known().frame
    large = sized(frame, 640, 480)
    assert large.color.shape == (480, 640, 3)
    assert large.depth_mm.shape == (480, 640)
    for pixel in ((0.0, 0.0), (159.5, 119.5), (319.0, 239.0)):
        small_ray = ((pixel[0] - frame.intrinsics.cx) / frame.intrinsics.fx,)
        same = 2 * pixel[0] + 0.5
        large_ray = ((same - large.intrinsics.cx) / large.intrinsics.fx,)
        assert small_ray == pytest.approx(large_ray)


def test_the_ratio_is_to_the_fast_runtime_alone():
    row = Row(
        row="detector 320x240",
        metric="per frame",
        unit="ms",
        better="lower",
        ours=12.0,
        interval=(11.0, 13.0),
        peer=Peer("onnxruntime 1.31", 10.0),
    )
    ratio = ratio_of(row)
    assert ratio is not None
    assert (ratio.ours, ratio.interval, ratio.asked) == (1.2, (1.1, 1.3), 1.5)
    slow = msgspec.structs.replace(row, peer=Peer("onnxruntime 1 without graph optimisation", 20.0))
    assert ratio_of(slow) is None
    assert ratio_of(msgspec.structs.replace(row, peer=None)) is None


@pytest.fixture
def images(tmp_path: Path) -> Path:
    """Two pictures of different sizes, and a file that is none."""
    folder = tmp_path / "images"
    folder.mkdir()
    for number, (height, width) in enumerate(((240, 320), (300, 500))):
        picture = np.random.default_rng(number).integers(0, 255, (height, width, 3), np.uint8)
        cv2.imwrite(str(folder / f"{number}.png"), picture)
    (folder / "broken.png").write_bytes(b"no picture")
    return folder


def test_own_pictures_give_times_counts_and_a_sheet(
    images: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    plot = tmp_path / "plot"
    arguments = ["bench", "perception", "--images", str(images), "--plot", str(plot), "--json"]
    assert main(arguments) == 0
    document = json.loads(capsys.readouterr().out)
    times = {row["metric"] for row in document["rows"] if row["row"] == "own pictures, detector"}
    assert times == {"time, p50", "time, p95"}
    assert any("2 pictures of" in line for line in document["settings"])
    ((reason, count),) = document["failures"]["pictures"].items()
    assert ("broken.png" in reason, count) == (True, 1)
    sheet = cv2.imread(str(plot / "perception.png"))
    assert sheet is not None
    assert sheet.shape[:2] == (300, 800)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["perception", "--images", "/nowhere"], ["/nowhere"]),
        (["mapping", "--images", "/tmp"], ["--images", "perception", "mapping"]),
        (["perception", "--classes", "names.txt"], ["--detector"]),
    ],
)
def test_what_cannot_be_done_is_refused_in_one_line(
    arguments: list[str], words: list[str], capsys: pytest.CaptureFixture[str]
):
    assert main(["bench", *arguments]) == 2
    told = capsys.readouterr().err.strip()
    assert len(told.splitlines()) == 1
    assert all(word in told for word in words)


def test_rows_of_places_say_what_the_card_says():
    rng, types = np.random.default_rng(1), len(ROOM_KINDS)
    truth = rng.integers(0, types, 400).astype(np.int32)
    logits = rng.normal(0, 2, (400, types))
    logits[np.arange(400), truth] += 4.0
    said = np.repeat(logits[:, None], 3, axis=1)
    looks = Looks(said, said, truth, np.repeat(truth[:, None], 3, axis=1))
    nothing = {"training_pictures": 0, "validation_pictures": 0, "seed": 0, "windows_seen": 0}
    card = PlacesCard(types=ROOM_KINDS, sha256="", licence="", data="", parameters=0, **nothing)
    rows = by_metric(judged_rows(card, looks))
    told = figures(ROOM_KINDS, looks.pooled(1.0, 1.0), truth)
    right = rows["place of the camera", "likeliest type is right"]
    assert right.ours == pytest.approx(100 * told.accuracy)
    assert right.interval[0] < right.ours < right.interval[1]
    error = rows["place of the camera", "calibration error"]
    assert error.ours == pytest.approx(told.calibration_error)
    # No window shows another place than the camera is in.
    assert not [row for row, _ in rows if "doorway" in row]
