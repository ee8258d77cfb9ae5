import json
import math
from pathlib import Path

import cv2
import numpy as np
import pytest

from robots.husky.spec import HUSKY
from schemas import topics
from schemas.errors import MissingComponentError, UserError
from schemas.geometry import Pose3
from schemas.health import Fault, Tick
from schemas.run import RunConfig
from schemas.sensing import RgbdFrame
from services.cli import main
from services.perception.camera.lens import Framing, Lens, LensError, read_lens, supposed_lens
from services.perception.camera.source import (
    CameraSource,
    CameraSourceError,
    NoCameraError,
    open_source,
)
from services.perception.camera_node import CameraNode
from services.process_table import PROCESSES

AHEAD = Pose3((0.0, 0.0, 1.0), (0.5, -0.5, 0.5, -0.5))
COLORS = ((255, 0, 0), (0, 255, 0), (0, 0, 255))
"""RGB."""


def plain(color: tuple[int, int, int], height: int = 48, width: int = 64) -> np.ndarray:
    return np.full((height, width, 3), color, np.uint8)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Three plain pictures, named so that their order is the colours'."""
    for number, color in enumerate(COLORS):
        cv2.imwrite(str(tmp_path / f"{number}.png"), plain(color)[..., ::-1])
    (tmp_path / "notes.txt").write_text("no picture")
    return tmp_path


@pytest.fixture
def video(tmp_path: Path) -> Path:
    path = tmp_path / "three.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 10, (64, 48))
    for color in COLORS:
        writer.write(plain(color)[..., ::-1])
    writer.release()
    return path


def all_of(source: CameraSource) -> list[np.ndarray]:
    pictures: list[np.ndarray] = []
    while (picture := source.picture()) is not None:
        pictures.append(picture)
    source.close()
    return pictures


@pytest.mark.parametrize("kind", ["folder", "video"])
def test_pictures_come_in_order_and_in_rgb(kind: str, request: pytest.FixtureRequest):
    pictures = all_of(open_source(str(request.getfixturevalue(kind))))
    assert len(pictures) == 3
    for picture, color in zip(pictures, COLORS, strict=True):
        assert picture.shape == (48, 64, 3)
        np.testing.assert_allclose(picture.mean((0, 1)), color, atol=12)


def test_one_file_is_one_picture_and_grey_becomes_three_channels(tmp_path: Path):
    path = tmp_path / "grey.png"
    cv2.imwrite(str(path), np.full((30, 40), 77, np.uint8))
    (picture,) = all_of(open_source(str(path)))
    assert picture.shape == (30, 40, 3)
    assert set(np.unique(picture)) == {77}


def test_skipping_lets_a_video_go_by_but_no_file(folder: Path, video: Path):
    moving, lying = open_source(str(video)), open_source(str(folder))
    assert moving.skip()
    assert lying.skip()
    np.testing.assert_allclose(all_of(moving)[0].mean((0, 1)), COLORS[1], atol=12)
    np.testing.assert_array_equal(all_of(lying)[0][0, 0], COLORS[0])


@pytest.mark.parametrize(
    ("name", "error", "words"),
    [
        ("/nowhere/at-all", CameraSourceError, ["/nowhere/at-all", "rtsp://", "folder"]),
        ("/dev/video97", NoCameraError, ["/dev/video97", "cameras here"]),
        ("97", NoCameraError, ["/dev/video97"]),
    ],
)
def test_what_gives_no_pictures_is_refused_with_what_would(
    name: str, error: type[Exception], words: list[str]
):
    with pytest.raises(error) as refused:
        open_source(name)
    assert all(word in str(refused.value) for word in words)


def test_files_that_are_no_pictures_are_refused(tmp_path: Path):
    with pytest.raises(CameraSourceError, match="no pictures in"):
        open_source(str(tmp_path))
    for name in ("broken.png", "broken.mp4"):
        (tmp_path / name).write_bytes(b"neither picture nor video")
    with pytest.raises(CameraSourceError, match=r"broken\.png"):
        open_source(str(tmp_path / "broken.png")).picture()
    with pytest.raises(CameraSourceError, match=r"broken\.mp4"):
        open_source(str(tmp_path / "broken.mp4"))
    assert issubclass(CameraSourceError, UserError)
    assert issubclass(NoCameraError, MissingComponentError)


def test_a_picture_becomes_a_frame_that_fits_its_lens():
    lens = supposed_lens(1280, 960, math.radians(60))
    frame = Framing(lens, AHEAD, widest=320).frame(plain((9, 9, 9), 480, 640), 7)
    assert frame.color.shape == (240, 320, 3)
    assert not frame.depth_mm.any()
    camera = frame.intrinsics
    assert 2 * math.atan(camera.width / 2 / camera.fx) == pytest.approx(math.radians(60))
    assert (camera.cx, camera.cy) == pytest.approx((159.5, 119.5))


def test_distortion_is_taken_out():
    """Points drawn where a barrel lens shows them end up on the straight line they lie on."""
    lens = Lens(
        width=320, height=240, fx=200, fy=200, cx=159.5, cy=119.5, distortion=(-0.3, 0.0, 0.0, 0.0)
    )
    matrix = np.array([[200, 0, 159.5], [0, 200, 119.5], [0, 0, 1.0]])
    line = np.array([[x, -0.45, 1.0] for x in np.linspace(-0.6, 0.6, 9)])
    seen = cv2.projectPoints(line, np.zeros(3), np.zeros(3), matrix, np.array(lens.distortion))[0]
    picture = plain((0, 0, 0), 240, 320)
    for x, y in seen.reshape(-1, 2):
        cv2.circle(picture, (round(x), round(y)), 2, (255, 255, 255), -1)
    assert np.ptp(seen[:, 0, 1]) > 8
    straight = Framing(lens, AHEAD, 320).frame(picture, 0).color[..., 0]
    rows = np.flatnonzero(straight.max(axis=1) > 150)
    assert abs(rows.mean() - (119.5 - 0.45 * 200)) < 1.5
    assert np.ptp(rows) <= 8


def test_a_lens_of_other_proportions_is_refused():
    with pytest.raises(LensError, match="640x360"):
        Framing(supposed_lens(640, 480, 1.0), AHEAD, 320).frame(plain((0, 0, 0), 360, 640), 0)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("{}", ["width", "an example"]),
        ('{"width": 1, "height": 1, "fx": 0, "fy": 1, "cx": 0, "cy": 0}', ["more than 0"]),
        (
            '{"width":1,"height":1,"fx":1,"fy":1,"cx":0,"cy":0,"distortion":[1]}',
            ["1 distortion", "4, 5 or 8"],
        ),
    ],
)
def test_a_calibration_that_cannot_be_used_says_why(tmp_path: Path, content: str, words: list[str]):
    path = tmp_path / "lens.json"
    path.write_text(content)
    with pytest.raises(LensError) as refused:
        read_lens(path)
    assert all(word in str(refused.value) for word in [*words, str(path)])


def test_the_node_publishes_at_the_camera_s_rate_and_says_once_that_it_is_over(folder: Path):
    node = CameraNode(RunConfig(robot="husky", camera=str(folder)), np.random.default_rng(0))
    step_ns = 1_000_000_000 // 30
    said = [
        output for number in range(60) for output in node.on_tick(Tick(stamp_ns=number * step_ns))
    ]
    node.close()
    frames = [one.message for one in said if one.topic is topics.RGBD]
    faults = [one.message for one in said if one.topic is topics.FAULT]
    assert all(isinstance(frame, RgbdFrame) for frame in frames)
    assert [frame.color[0, 0].tolist() for frame in frames] == [list(color) for color in COLORS]
    gaps = np.diff([frame.stamp_ns for frame in frames])
    assert (abs(gaps - 1e9 / HUSKY.camera.rate_hz) <= step_ns).all()
    assert [fault.what for fault in faults if isinstance(fault, Fault)] == ["no more pictures"]


def test_a_broken_picture_is_told_of_and_the_next_one_shown(folder: Path):
    (folder / "0.png").write_bytes(b"cut short")
    node = CameraNode(RunConfig(robot="husky", camera=str(folder)), np.random.default_rng(0))
    ticks = [Tick(stamp_ns=number * 1_000_000_000) for number in range(2)]
    refused, shown = [output for tick in ticks for output in node.on_tick(tick)]
    assert refused.message.what == "picture refused"
    assert "0.png" in refused.message.detail
    assert shown.message.color[0, 0].tolist() == list(COLORS[1])


def test_pictures_from_outside_take_the_robot_s_place():
    def names(**settings: str) -> set[str]:
        run = RunConfig(**settings)
        return {process.name for process in PROCESSES if process.takes_part(run)}

    assert "camera" not in names()
    assert "scenes" not in names(robot="husky")
    assert "scenes" in names(robot="wheelchair")
    assert names(camera="0") == names() - {"robot"} | {"camera"}


def test_look_tells_of_every_picture_and_draws_it(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    out = tmp_path / "drawn"
    arguments = ["look", "--camera", str(folder), "--robot", "husky", "--out", str(out), "--json"]
    assert main(arguments) == 0
    told = json.loads(capsys.readouterr().out)
    assert [one["place"] for one in told["frames"]] == [{}] * 3
    assert sorted(path.name for path in out.iterdir()) == [f"{n:06d}.png" for n in range(3)]


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["--camera", "/dev/video97"], 5, ["/dev/video97"]),
        (["--camera", "/nowhere"], 2, ["/nowhere", "rtsp://"]),
        (["--camera", "0", "--fov-deg", "200"], 2, ["200", "179"]),
        (["--camera", "0", "--fov-deg", "60", "--calibration", "x.json"], 2, ["--calibration"]),
    ],
)
def test_look_refuses_in_one_line(
    arguments: list[str], code: int, words: list[str], capsys: pytest.CaptureFixture[str]
):
    assert main(["look", "--robot", "husky", *arguments]) == code
    said = capsys.readouterr().err.strip()
    assert len(said.splitlines()) == 1
    assert all(word in said for word in words)
