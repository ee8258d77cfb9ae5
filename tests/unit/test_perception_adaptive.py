"""The perception process with attention and without: what it says, and what it leaves unsaid."""

from pathlib import Path

import msgspec
import numpy as np
import pytest

from robots.husky.spec import HUSKY
from schemas import topics
from schemas.codec import decode, encode
from schemas.geometry import Pose2
from schemas.language import Annotation, Annotations, BehaviorSymbol, Relation
from schemas.perception import Detections, Focus
from schemas.run import RunConfig
from schemas.sensing import Intrinsics, RgbdFrame
from schemas.task import InstructionStatus, TaskState
from services.perception.attention.interest import Interest
from services.perception.detection.bank import DetectorBank
from services.perception.detection.boxes import Boxes
from services.perception.detection.detector import Detector, default_weights
from services.perception.detection.gaze import EVERYTHING, Gaze
from services.perception.node import PerceptionNode
from services.perception.scene import Recogniser
from services.perception.space.forms import read_forms

DATA = Path(__file__).parents[1] / "data"
FRAME_NS = 200_000_000
CLASSES = ("cone", "hydrant", "car", "drill")


@pytest.fixture(scope="module")
def frame() -> RgbdFrame:
    with np.load(DATA / "perception_frame.npz") as arrays:
        return RgbdFrame(
            stamp_ns=10_000_000_000,
            color=arrays["color"],
            depth_mm=arrays["depth_mm"],
            intrinsics=Intrinsics(320, 240, *arrays["intrinsics"].tolist()),
            base_from_camera=HUSKY.camera.base_from_camera,
            odom_from_base=Pose2(1.0, 2.0, 0.3),
        )


def says(*relations: tuple[str, str, str], id: str = "i1", probability: float = 1.0) -> Annotations:
    figure, relation, landmark = relations[0]
    said = tuple(Relation(name, one, other) for one, name, other in relations)
    return Annotations(
        stamp_ns=0,
        instruction_id=id,
        text="",
        understood=True,
        parse="",
        parse_probability=1.0,
        annotations=(Annotation(probability=probability, objects=(figure,), relations=said),),
        behaviors=(
            BehaviorSymbol(
                probability=probability,
                action="navigate",
                object=figure,
                mode="unknown",
                relation=relation,
                landmark=landmark,
            ),
        ),
        unknown_words=(),
        question=None,
        possible=(),
    )


def status(id: str, state: TaskState) -> InstructionStatus:
    return InstructionStatus(
        stamp_ns=0,
        instruction_id=id,
        text="",
        state=state,
        failure=None,
        reason="",
        started_ns=0,
        decisions=0,
    )


def interest() -> Interest:
    return Interest(CLASSES, ("kitchen",))


def test_figures_landmarks_and_what_clues_need_are_wanted():
    one = interest()
    one.hear(says(("hydrant", "back", "cone"), ("cone", "near", "car")))
    assert one.wanted == {"hydrant", "cone", "car"}


def test_a_bare_thing_has_no_landmark_and_the_robot_and_places_are_not_looked_for():
    one = interest()
    bare = says(("hydrant", "left", "robot"))
    behavior = msgspec.structs.replace(bare.behaviors[0], relation="unknown", landmark="unknown")
    one.hear(msgspec.structs.replace(bare, behaviors=(behavior,)))
    assert one.wanted == {"hydrant"}
    one.hear(says(("hydrant", "inside", "kitchen")))
    assert one.wanted == {"hydrant"}


@pytest.mark.parametrize("name", ["unknown", "walrus"])
def test_what_no_network_knows_by_name_may_be_anything(name: str):
    one = interest()
    one.hear(says((name, "back", "cone")))
    assert one.wanted == set(CLASSES)


def test_what_is_out_of_the_question_is_not_wanted():
    one = interest()
    one.hear(says(("hydrant", "back", "cone"), probability=0.001))
    assert one.wanted == set()


def test_wishes_end_with_their_instruction_and_an_earlier_one_goes_on():
    one = interest()
    one.hear(says(("hydrant", "back", "cone"), id="first"))
    one.hear(says(("drill", "near", "car"), id="second"))
    assert one.wanted == {"drill", "car"}
    one.follow(status("second", TaskState.SUCCEEDED))
    assert one.wanted == set()
    one.follow(status("first", TaskState.ACTIVE))
    assert one.wanted == {"hydrant", "cone"}
    one.follow(status("first", TaskState.CANCELLED))
    assert one.wanted == set()


def test_an_instruction_that_has_ended_is_not_taken_up_by_a_late_message():
    one = interest()
    one.follow(status("i1", TaskState.FAILED))
    one.hear(says(("hydrant", "back", "cone")))
    assert one.wanted == set()


def told(node: PerceptionNode, frame: RgbdFrame) -> dict[str, msgspec.Struct]:
    outputs = node.handlers()[topics.RGBD](frame)
    return {output.topic.key: output.message for output in outputs}


def node_that_wants(figure: str = "hydrant") -> PerceptionNode:
    node = PerceptionNode(RunConfig(), np.random.default_rng(0))
    list(node.handlers()[topics.ANNOTATIONS](says((figure, "back", "cone"))))
    return node


def later(frame: RgbdFrame, count: int = 1) -> RgbdFrame:
    return msgspec.structs.replace(frame, stamp_ns=frame.stamp_ns + count * FRAME_NS)


def test_turned_off_it_says_what_the_recogniser_says_and_nothing_else(frame: RgbdFrame):
    node = PerceptionNode(RunConfig(adaptive=False), np.random.default_rng(0))
    handlers = node.handlers()
    list(handlers[topics.ANNOTATIONS](says(("hydrant", "back", "cone"))))
    alone = Recogniser(Detector(), read_forms(), HUSKY.camera.range_max)
    for one in (frame, later(frame), later(frame, 2)):
        seen = alone.recognised(one)
        outputs = [(o.topic, encode(o.message)) for o in handlers[topics.RGBD](one)]
        assert outputs == [
            (topics.DETECTIONS, encode(seen.detections)),
            (topics.BODIES, encode(seen.bodies)),
        ]
        assert seen.detections.unsought == ()


def test_a_first_look_finds_what_looking_at_everything_finds(frame: RgbdFrame):
    thorough = PerceptionNode(RunConfig(adaptive=False), np.random.default_rng(0))
    every, found = (told(one, frame)["detections"] for one in (thorough, node_that_wants()))
    assert isinstance(every, Detections)
    assert isinstance(found, Detections)
    assert len(every.scores) > 0
    for row in range(len(every.scores)):
        apart = np.linalg.norm(found.centers_base - every.centers_base[row], axis=1)
        name = found.probabilities[int(apart.argmin())].argmax()
        assert apart.min() < 0.2
        assert name == every.probabilities[row].argmax()


def test_a_frame_that_is_held_says_so_and_is_no_evidence(frame: RgbdFrame):
    node = node_that_wants()
    for count in range(2):
        assert "detections" in told(node, later(frame, count))
    said = told(node, later(frame, 2))
    assert set(said) == {"focus"}
    focus = said["focus"]
    assert isinstance(focus, Focus)
    assert focus.seen_ns == later(frame).stamp_ns
    assert focus.reason == "same view as 0.2 s ago"
    assert focus.work == 0
    assert 0 < focus.saved < 1
    assert decode(encode(focus), Focus).wanted == ("cone", "hydrant")


def test_a_new_wish_is_looked_for_in_the_next_frame(frame: RgbdFrame):
    node = node_that_wants()
    said = [told(node, later(frame, count)) for count in range(3)]
    assert "detections" not in said[-1]
    list(node.handlers()[topics.ANNOTATIONS](says(("car", "back", "cone"), id="i2")))
    assert "detections" in told(node, later(frame, 3))


def test_a_frame_that_could_not_be_used_holds_nothing(frame: RgbdFrame):
    node = node_that_wants()
    for count in range(2):
        told(node, later(frame, count))
    black = msgspec.structs.replace(later(frame, 2), color=np.zeros_like(frame.color))
    told(node, black)
    assert "detections" in told(node, later(frame, 3))


def test_a_network_that_takes_any_size_finds_the_same_in_a_part(frame: RgbdFrame):
    detector = Detector()
    every = detector.detect(frame.color)
    best = every.corners_px[0]
    low, high = np.maximum(best[:2] - 24, 0), np.minimum(best[2:] + 24, [320, 240])
    gaze = Gaze(np.array([[*low, *high]], np.int32))
    found = detector.detect(frame.color, gaze)
    assert detector.pixels(320, 240, gaze) < detector.pixels(320, 240)
    np.testing.assert_allclose(found.corners_px[0], best, atol=3)
    (shown,) = detector.looked_at(320, 240, gaze)
    assert (shown[:2] <= low).all()
    assert (shown[2:] >= high).all()
    assert found.classes[0] == every.classes[0]


def test_where_nothing_can_be_no_network_is_run(frame: RgbdFrame):
    nowhere = Gaze(np.zeros((0, 4), np.int32))
    detector = Detector()
    assert detector.pixels(320, 240, nowhere) == 0
    assert detector.detect(frame.color, nowhere).corners_px.shape == (0, 4)


class Counting:
    """Counts how often it looks, and finds nothing."""

    def __init__(self, *classes: str) -> None:
        self.classes, self.looks = classes, 0
        self.groups = (classes,)

    def detect(self, color: np.ndarray, gaze: Gaze = EVERYTHING) -> Boxes:
        self.looks += 1
        none = np.zeros((0, len(self.classes)))
        return Boxes(np.zeros((0, 4)), np.zeros(0), none, none)

    def looked_at(self, width: int, height: int, gaze: Gaze = EVERYTHING) -> np.ndarray:
        return np.array([[0.0, 0, width, height]])

    def pixels(self, width: int, height: int, gaze: Gaze = EVERYTHING) -> int:
        return width * height


def test_of_a_bank_only_those_run_that_are_chosen():
    one, other = Counting("cone", "hydrant"), Counting("drill")
    bank = DetectorBank([one, other])
    picture = np.zeros((48, 64, 3), np.uint8)
    found = bank.detect(picture, Gaze(networks=frozenset({0})))
    assert (one.looks, other.looks) == (1, 0)
    assert found.probabilities.shape == (0, 3)
    assert bank.pixels(64, 48, Gaze(networks=frozenset({0}))) == 64 * 48
    assert bank.looked_at(64, 48).tolist() == [[0, 0, 64, 48]]
    assert bank.looked_at(64, 48, Gaze(networks=frozenset())).shape == (0, 4)
    assert bank.groups == (("cone", "hydrant"), ("drill",))


def test_a_bank_says_which_classes_it_did_not_look_for(frame: RgbdFrame, tmp_path: Path):
    weights = str(default_weights)
    names = [tmp_path / "own.txt", tmp_path / "others.txt"]
    count = len(Detector().classes)
    names[0].write_text("\n".join(Detector().classes))
    names[1].write_text("\n".join(f"thing {k}" for k in range(count)))
    run = RunConfig(detectors=(weights, weights), detector_classes=tuple(map(str, names)))
    node = PerceptionNode(run, np.random.default_rng(0))
    list(node.handlers()[topics.ANNOTATIONS](says(("hydrant", "back", "cone"))))
    moved = msgspec.structs.replace(later(frame), odom_from_base=Pose2(1.1, 2.0, 0.3))
    first, second = (told(node, one)["detections"] for one in (frame, moved))
    assert isinstance(first, Detections)
    assert isinstance(second, Detections)
    assert first.unsought == ()
    assert second.unsought == tuple(f"thing {k}" for k in range(count))
    assert second.classes == first.classes
