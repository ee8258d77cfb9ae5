"""What people take out of a log: tables, films, pictures."""

import csv
import io
import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image

from robots.colours import class_colour
from schemas import topics
from schemas.belief import MapBelief
from schemas.codec import encode
from schemas.errors import UserError
from schemas.geometry import Pose2
from services.commands.logs import log
from services.perception.camera.video_file import write_video
from services.recorder.export.camera import FPS, film
from services.recorder.export.decisions import HEAD, write_decisions
from services.recorder.export.map_film import Scene
from services.recorder.export.map_picture import Window, draw_map
from services.recorder.export.pace import evenly
from services.recorder.viewer.scene import seen_rows
from services.runtime.log_file import LogError, read_messages
from services.runtime.mailbox import Sample
from services.runtime.record import LogWriter
from tests.replay.cases import CASES

by_name = {case.name: case for case in CASES}


@pytest.fixture(scope="module")
def run_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What mapping and perception heard and said, with the stamps as times."""
    path = tmp_path_factory.mktemp("run") / "run.mcap"
    stamped = [
        (message.stamp_ns, topic, data)
        for name in ("mapping", "policy", "perception")
        for topic, message, data in contents(by_name[name].path)
    ]
    writer = LogWriter(path, {})
    for number, (at_ns, topic, data) in enumerate(sorted(stamped, key=lambda one: one[0])):
        writer.write(Sample(topic, data, 1, number, at_ns), at_ns)
    writer.close()
    return path


def contents(path: Path):
    for _, topic, message in read_messages(path, topics.ALL_TOPICS):
        yield topic, message, encode(message)


def test_things_come_at_even_times_whatever_their_own_are():
    timed = [(0, "a"), (4, "b"), (5, "c"), (31, "d")]
    assert "".join(evenly(timed, 10)) == "acccd"
    assert list(evenly([], 10)) == []


def test_the_table_has_a_row_for_every_decision_and_the_chosen_ones_figures(run_file: Path):
    out = io.StringIO()
    count = write_decisions(run_file, out)
    rows = list(csv.DictReader(io.StringIO(out.getvalue())))
    decisions = [message for _, _, message in read_messages(run_file, (topics.DECISION,))]
    assert count == len(rows) == len(decisions) > 2
    assert tuple(rows[0]) == HEAD
    for row, decision in zip(rows, decisions, strict=True):
        assert row["kind"] == decision.kinds[decision.chosen]
        assert float(row["cost"]) == pytest.approx(decision.costs[decision.chosen], abs=1e-4)
        assert row["reason"] == decision.reason


def test_the_film_runs_as_fast_as_the_run_and_shows_the_cameras_pictures(
    run_file: Path, tmp_path: Path
):
    target = tmp_path / "camera.webm"
    stamps = [log_ns for log_ns, _, _ in read_messages(run_file, (topics.RGBD,))]
    count = write_video(film(run_file), target, FPS)
    assert count == pytest.approx((stamps[-1] - stamps[0]) / 1e9 * FPS, abs=2)
    capture = cv2.VideoCapture(str(target))
    assert capture.get(cv2.CAP_PROP_FPS) == FPS
    there, picture = capture.read()
    assert there
    (_, _, frame), *_ = read_messages(run_file, (topics.RGBD,))
    small = cv2.resize(picture[..., ::-1].copy(), frame.color.shape[1::-1])
    assert np.abs(small.astype(int) - frame.color).mean() < 12


def test_a_video_that_no_player_would_open_is_refused(tmp_path: Path):
    with pytest.raises(UserError, match=r"\.webm"):
        write_video([np.zeros((16, 16, 3), np.uint8)], tmp_path / "film.txt", 10)


def test_seen_objects_and_the_robot_lie_where_they_are_in_the_picture(run_file: Path):
    beliefs = [message for _, _, message in read_messages(run_file, (topics.BELIEF,))]
    belief: MapBelief = beliefs[-1]
    window = Window((-10.0, -6.0), (10.0, 6.0))
    scene = Scene(belief=belief, odom_from_base=Pose2(-8.0, -4.0, 0.0))
    picture = np.asarray(draw_map(window, scene, 0.0))
    row = int(seen_rows(belief)[0])
    (x, y) = belief.position[row]
    pixel = picture[round((6.0 - y) * window.scale), round((x + 10.0) * window.scale)]
    assert tuple(pixel) == class_colour(belief.classes[belief.class_index[row]])
    assert window.scale == 32


def test_the_map_film_has_a_picture_each_half_second(run_file: Path, tmp_path: Path):
    assert log("export", run_file, "map", tmp_path / "map.gif") == 0
    with Image.open(tmp_path / "map.gif") as gif:
        assert 10 <= gif.n_frames <= 30
        first = np.asarray(gif.convert("RGB"))
        gif.seek(gif.n_frames - 1)
        assert (np.asarray(gif.convert("RGB")) != first).any(axis=-1).mean() > 0.02


def test_messages_are_exported_as_json_lines(
    run_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    small = tmp_path / "small.mcap"
    writer = LogWriter(small, {})
    for log_ns, topic, message in read_messages(run_file, (topics.GOAL, topics.DECISION)):
        writer.write(Sample(topic, encode(message), 1, 0, log_ns), log_ns)
    writer.close()
    assert log("export", small, out=tmp_path / "a.jsonl", json=True) == 0
    lines = [json.loads(line) for line in (tmp_path / "a.jsonl").read_text().splitlines()]
    assert json.loads(capsys.readouterr().out)["count"] == len(lines)
    assert {line["topic"] for line in lines} == {"goal", "decision"}


@pytest.mark.parametrize("what", ["decisions", "camera", "map"])
def test_what_is_not_in_a_log_cannot_be_exported(what: str, tmp_path: Path):
    writer = LogWriter(tmp_path / "empty.mcap", {})
    writer.write(Sample(topics.TICK, b"\x81\xa8stamp_ns\x01", 1, 0, 0), 0)
    writer.close()
    with pytest.raises(UserError, match=f"nothing of the {what}"):
        log("export", tmp_path / "empty.mcap", what)  # type: ignore[arg-type]


def test_messages_of_another_version_are_refused_with_their_topic(tmp_path: Path):
    writer = LogWriter(tmp_path / "old.mcap", {})
    writer.write(Sample(topics.GOAL, b"\x80", 1, 0, 0), 0)
    writer.close()
    with pytest.raises(LogError, match="goal"):
        list(read_messages(tmp_path / "old.mcap", (topics.GOAL,)))
