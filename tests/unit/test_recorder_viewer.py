"""What viewers see of a run: in well-known schemas, in one file with the messages themselves."""

import io
import itertools
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from google.protobuf.message import Message
from mcap.reader import make_reader
from PIL import Image

from robots.husky.spec import HUSKY
from schemas import topics
from schemas.belief import MapBelief, OccupancyGrid
from schemas.codec import decode, encode
from schemas.geometry import Pose2, Pose3
from schemas.health import Fault, Heartbeat
from schemas.language import Answer
from schemas.motion import StopLatch
from schemas.perception import Detections
from schemas.run import RunConfig
from schemas.sensing import LaserScan, Odometry, RgbdFrame
from schemas.task import CancelRequest
from services.recorder.run_log import LATE_NS, RunLog
from services.recorder.viewer import ground, picture, scene
from services.recorder.viewer.channels import Viewer, channels
from services.recorder.viewer.frames import Frames
from services.recorder.viewer.numbers import FIELDS
from services.runtime.log_file import log_summary, read_log
from services.runtime.mailbox import Sample
from tests.replay.cases import CASES

root = Path(__file__).parents[2]
layout_file = root / "deploy" / "foxglove" / "incognita.json"
by_name = {case.name: case for case in CASES}

told_rarely = (
    topics.FAULT.of(Fault(stamp_ns=5, node="mapping", what="odd", detail="very")),
    topics.ANSWER.of(Answer(stamp_ns=5, instruction_id="1", text="a cone", source="cli")),
    topics.STOP.of(StopLatch(stamp_ns=5, stopped=True, source="web:1")),
    topics.CANCEL.of(CancelRequest(stamp_ns=5, source="cli")),
    topics.HEARTBEAT.of(
        Heartbeat(
            stamp_ns=5,
            node="mapping",
            pid=1,
            handled=9,
            busy=0.25,
            lost=0,
            replaced=0,
            malformed=0,
            handler_ms=1.0,
        )
    ),
)
"""What no recording of `tests.replay` holds."""


def samples() -> Iterator[Sample]:
    """Real messages of all kinds, each at a time of its own, far enough apart to be shown."""
    numbers = itertools.count(1)
    for name in ("mapping", "perception", "policy", "navigation", "grounding"):
        for record in itertools.islice(read_log(by_name[name].path), 150):
            at_ns = next(numbers) * 10_000_000_000
            yield Sample(topics.topic_named(record.topic), record.data, 1, at_ns, at_ns)
    for output in told_rarely:
        at_ns = next(numbers) * 10_000_000_000
        yield Sample(output.topic, encode(output.message), 1, 0, at_ns)


def first(case: str, topic: topics.Topic[Any], skip: int = 0) -> Any:
    found = (r.data for r in read_log(by_name[case].path, (topic,)))
    return decode(next(itertools.islice(found, skip, None)), topic.type)


@pytest.fixture(scope="module")
def run_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("run") / "run.mcap"
    log = RunLog(path, RunConfig(seed=6))
    for sample in samples():
        log.write(sample, sample.sent_ns)
    log.close()
    return path


def decoded(path: Path) -> Iterator[tuple[str, str, int, Message]]:
    """Topic, schema, time and message of every channel for viewers, by the file's own schemas."""
    pools: dict[int, type[Message]] = {}
    with path.open("rb") as stream:
        for schema, channel, message in make_reader(stream).iter_messages():
            if channel.message_encoding != "protobuf":
                continue
            assert schema is not None
            if channel.id not in pools:
                pool = descriptor_pool.DescriptorPool()
                for file in descriptor_pb2.FileDescriptorSet.FromString(schema.data).file:
                    pool.Add(file)
                pools[channel.id] = message_factory.GetMessageClass(
                    pool.FindMessageTypeByName(schema.name)
                )
            content = pools[channel.id].FromString(message.data)
            yield channel.topic, schema.name, message.log_time, content


def test_every_channel_is_read_by_the_schema_that_its_file_holds(run_file: Path):
    seen = {topic: schema for topic, schema, _, _ in decoded(run_file)}
    assert seen.keys() == {row.topic for row in channels(HUSKY)}
    well_known = {name: schema for name, schema in seen.items() if "/numbers/" not in name}
    assert all(schema.startswith("foxglove.") for schema in well_known.values())
    assert {name.split(".")[-1] for name in seen.values()} >= FIELDS.keys()


def test_nothing_of_what_was_sent_is_changed_or_left_out(run_file: Path):
    sent = [(s.topic.key, s.sent_ns, s.payload) for s in samples()]
    assert [(r.topic, r.log_ns, r.data) for r in read_log(run_file)] == sent
    summary = log_summary(run_file)
    assert not any(name.startswith("/") for name in summary["topics"])
    assert summary["shown"].keys() == {row.topic for row in channels(HUSKY)}


def test_what_is_shown_bears_the_time_of_the_evidence():
    frame = first("perception", topics.RGBD)
    shown = picture.image(frame)
    assert shown.timestamp.seconds * 10**9 + shown.timestamp.nanos == frame.stamp_ns


def test_drawing_costs_no_more_when_there_is_more_traffic():
    payload = encode(first("mapping", topics.BELIEF))
    viewer, second = Viewer(HUSKY), 1_000_000_000
    times = range(0, 2 * second, second // 100)
    shown = [
        one.topic
        for at_ns in times
        for one in viewer.show(Sample(topics.BELIEF, payload, 1, at_ns, at_ns))
    ]
    assert 3 <= shown.count("/map/objects") <= 5


def test_a_recorder_that_is_behind_keeps_everything_and_draws_nothing(tmp_path: Path):
    log = RunLog(tmp_path / "late.mcap", RunConfig())
    payload = encode(first("perception", topics.RGBD))
    for number, late_ns in enumerate((0, 2 * LATE_NS, 0)):
        at_ns = number * 10**10
        log.write(Sample(topics.RGBD, payload, 1, number, at_ns), at_ns + late_ns)
    log.close()
    summary = log_summary(tmp_path / "late.mcap")
    assert summary["topics"] == {"camera/rgbd": 3}
    assert summary["shown"]["/camera/image"] == 2


def test_a_message_that_cannot_be_read_is_kept_and_not_shown(tmp_path: Path):
    log = RunLog(tmp_path / "odd.mcap", RunConfig())
    log.write(Sample(topics.BELIEF, b"\xc1", 1, 0, 0), 0)
    log.close()
    assert [record.data for record in read_log(tmp_path / "odd.mcap")] == [b"\xc1"]
    assert log_summary(tmp_path / "odd.mcap")["shown"] == {}


def test_the_picture_is_the_cameras_but_for_compression():
    frame: RgbdFrame = first("perception", topics.RGBD)
    shown = picture.image(frame)
    pixels = np.asarray(Image.open(io.BytesIO(shown.data)))
    assert shown.format == "jpeg"
    assert len(shown.data) < frame.color.nbytes / 8
    assert np.abs(pixels.astype(int) - frame.color).mean() < 5


def test_boxes_lie_where_things_were_found():
    found: Detections = first("perception", topics.DETECTIONS)
    drawn = picture.boxes(found)
    assert len(drawn.points) == len(drawn.texts) == len(found.scores) > 0
    corners = [(point.x, point.y) for point in drawn.points[0].points]
    x0, y0, x1, y1 = found.boxes_px[0].tolist()
    assert corners == [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]


def test_frames_are_one_tree_that_leads_to_the_map():
    frames = Frames(HUSKY)
    belief: MapBelief = first("mapping", topics.BELIEF)
    assert not list(
        frames.on_belief(msgspec.structs.replace(belief, map_from_odom=Pose2(1, 2, 0.5)))
    )
    odometry: Odometry = first("mapping", topics.ODOMETRY)
    shown = frames.on_odometry(msgspec.structs.replace(odometry, odom_from_base=Pose2(3, 0, 0.1)))
    poses = {one.child_frame_id: (one.parent_frame_id, pose_of(one)) for one in shown.transforms}
    name, from_camera = "camera", Pose3((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
    while name != "map":
        name, pose = poses[name]
        from_camera = pose @ from_camera
    expected = (Pose2(1, 2, 0.5) @ Pose2(3, 0, 0.1)).lifted() @ HUSKY.camera.base_from_camera
    assert from_camera.position == pytest.approx(expected.position)
    assert from_camera.rotation() == pytest.approx(expected.rotation())


def pose_of(transform: Any) -> Pose3:
    at, turned = transform.translation, transform.rotation
    return Pose3((at.x, at.y, at.z), (turned.w, turned.x, turned.y, turned.z))


def test_a_scan_has_the_same_beams():
    turn: LaserScan = first("mapping", topics.SCAN)
    shown = ground.scan(turn)
    assert np.array_equal(np.array(shown.ranges, np.float32), turn.ranges)
    step = (shown.end_angle - shown.start_angle) / (len(shown.ranges) - 1)
    assert step == pytest.approx(turn.angle_increment)


def test_the_floor_has_a_colour_for_every_cell():
    grid: OccupancyGrid = first("mapping", topics.GRID, skip=8)
    shown = ground.grid(grid)
    rows, columns = grid.occupancy.shape
    cells = np.frombuffer(shown.data, np.uint8).reshape(rows, columns, 4)
    assert (shown.column_count, shown.row_stride) == (columns, 4 * columns)
    assert (cells[grid.occupancy == 0, 3] == 0).all()
    darkness = 255 - cells[..., :3].mean(axis=-1)
    assert darkness[grid.occupancy > 0].min() > darkness[grid.occupancy < 0].max()


def test_guesses_are_the_clearer_the_more_is_believed_in_them():
    belief: MapBelief = first("mapping", topics.BELIEF, skip=30)
    heavy = int(belief.particle[belief.particle >= 0][0])
    weights = np.full(len(belief.weights), 0.5 / (len(belief.weights) - 1))
    weights[heavy] = 0.5
    shown = scene.belief_scene(msgspec.structs.replace(belief, weights=weights))
    cubes = [cube for entity in shown.entities if "guessed" in entity.id for cube in entity.cubes]
    clearest = max(cubes, key=lambda cube: cube.color.a)
    at = (clearest.pose.position.x, clearest.pose.position.y)
    of_heavy = belief.position[belief.particle == heavy].tolist()
    assert list(at) in of_heavy


def test_seen_objects_have_names_and_stand_on_the_ground():
    belief: MapBelief = first("mapping", topics.BELIEF, skip=30)
    (seen,) = [e for e in scene.belief_scene(belief).entities if e.id == "seen"]
    assert len(seen.cubes) == len(seen.texts) > 0
    assert all(2 * c.pose.position.z == pytest.approx(c.size.z) for c in seen.cubes)
    assert any(text.text.startswith("cone") for text in seen.texts)


def test_words_and_faults_stand_in_the_log(run_file: Path):
    lines = {(m.name, m.message) for topic, _, _, m in decoded(run_file) if topic == "/log"}  # type: ignore[attr-defined]
    assert ("test", "go to the hydrant behind the cone") in lines
    assert ("mapping", "odd: very") in lines
    assert ("cli", "a cone") in lines


def layout_topics(layout: Any) -> Iterator[str]:
    """Everything in a layout that is the name of a topic or begins with one."""
    if isinstance(layout, dict):
        for key, value in layout.items():
            yield from [key] if key.startswith("/") else []
            yield from layout_topics(value)
    elif isinstance(layout, list):
        for value in layout:
            yield from layout_topics(value)
    elif isinstance(layout, str) and layout.startswith("/"):
        yield layout


def test_the_layout_names_topics_and_fields_that_there_are():
    rows = {row.topic for row in channels(HUSKY)}
    for name in layout_topics(json.loads(layout_file.read_text())):
        topic, _, field = name.partition("{")[0].partition(".")
        field = field or name.rpartition("}.")[2]
        assert topic in rows
        if "/numbers/" in topic:
            assert field in FIELDS[topic.rsplit("/", 1)[1].capitalize()]


def test_every_panel_of_the_layout_is_placed_and_described():
    layout = json.loads(layout_file.read_text())

    def placed(node: Any) -> Iterator[str]:
        if isinstance(node, str):
            yield node
        else:
            yield from placed(node["first"])
            yield from placed(node["second"])

    assert sorted(placed(layout["layout"])) == sorted(layout["configById"])
