"""Frames in which nothing can be recognised are dropped with the reason; the node lives on."""

import math
import re
from collections.abc import Iterator
from pathlib import Path

import msgspec
import numpy as np
import pytest

from robots.husky.spec import HUSKY
from schemas import topics
from schemas.codec import MalformedMessageError, decode, encode
from schemas.geometry import Pose2
from schemas.health import Fault
from schemas.run import RunConfig
from schemas.sensing import Intrinsics, RgbdFrame
from services.perception.errors import DetectorFileError
from services.perception.node import PerceptionNode

DATA = Path(__file__).parents[1] / "data"


@pytest.fixture(scope="module")
def node() -> PerceptionNode:
    return PerceptionNode(RunConfig(), np.random.default_rng(0))


@pytest.fixture(scope="module")
def stamps() -> Iterator[int]:
    """Far enough apart for every fault to be told."""
    return iter(range(10**12, 10**15, 10**10))


def good_frame(stamp_ns: int, **changes: object) -> RgbdFrame:
    with np.load(DATA / "perception_frame.npz") as arrays:
        frame = RgbdFrame(
            stamp_ns=stamp_ns,
            color=arrays["color"],
            depth_mm=arrays["depth_mm"],
            intrinsics=Intrinsics(320, 240, *arrays["intrinsics"].tolist()),
            base_from_camera=HUSKY.camera.base_from_camera,
            odom_from_base=Pose2(0.0, 0.0, 0.0),
        )
    return msgspec.structs.replace(frame, **changes)


def cut_short(color: np.ndarray) -> np.ndarray:
    cut = color.copy()
    cut[150:] = 128
    return cut


COLOR = good_frame(0).color
DEPTH = good_frame(0).depth_mm
FLAWS = {
    "black": ({"color": COLOR // 40}, "black"),
    "cut short": ({"color": cut_short(COLOR)}, "nothing came below row 150 of 240"),
    "four channels": ({"color": np.dstack([COLOR, COLOR[..., :1]])}, r"\(240, 320, 4\)"),
    "one channel": ({"color": COLOR[..., 0]}, r"\(240, 320\)"),
    "floating point": ({"color": COLOR / 255}, "float64"),
    "wrong size": ({"color": COLOR[:120, :160], "depth_mm": DEPTH[:120, :160]}, "160x120"),
    "depth of another size": ({"depth_mm": DEPTH[::2, ::2]}, r"\(120, 160\)"),
    "depth in metres": ({"depth_mm": DEPTH / 1000}, "float64"),
    "no focal length": ({"intrinsics": Intrinsics(320, 240, math.nan, 200, 160, 120)}, "nan"),
    "tiny": (
        {
            "color": COLOR[:8, :8],
            "depth_mm": DEPTH[:8, :8],
            "intrinsics": Intrinsics(8, 8, 5, 5, 4, 4),
        },
        "too small",
    ),
}


@pytest.mark.parametrize("flaw", FLAWS)
def test_a_bad_frame_is_dropped_with_the_reason(node: PerceptionNode, stamps, flaw: str):
    changes, told = FLAWS[flaw]
    (output,) = node.handlers()[topics.RGBD](good_frame(next(stamps), **changes))
    assert output.topic is topics.FAULT
    assert isinstance(output.message, Fault)
    assert output.message.node == "perception"
    assert output.message.what == "frame dropped"
    assert re.search(told, output.message.detail)
    after = node.handlers()[topics.RGBD](good_frame(next(stamps)))
    assert [output.topic for output in after] == [topics.DETECTIONS, topics.BODIES, topics.FOCUS]


def test_dropped_frames_are_counted_and_not_told_one_by_one():
    node = PerceptionNode(RunConfig(), np.random.default_rng(0))
    handle = node.handlers()[topics.RGBD]
    black = np.zeros_like(COLOR)
    outputs = [list(handle(good_frame(k * 10**8, color=black))) for k in range(12)]
    told = [output.message for each in outputs for output in each]
    assert len(told) == 2
    assert "10 times" in told[1].detail


def test_a_frame_cut_short_on_the_wire_never_reaches_the_node():
    data = encode(good_frame(0))
    with pytest.raises(MalformedMessageError):
        decode(data[: len(data) // 2], RgbdFrame)


def test_a_run_with_a_network_that_cannot_be_used_does_not_start(tmp_path: Path):
    broken = tmp_path / "broken.onnx"
    broken.write_bytes(b"\x08\x07 not a network")
    with pytest.raises(DetectorFileError, match=r"broken\.onnx"):
        PerceptionNode(RunConfig(detectors=(str(broken),)), np.random.default_rng(0))


def test_a_network_that_fails_on_a_frame_drops_that_frame(monkeypatch, stamps):
    node = PerceptionNode(RunConfig(), np.random.default_rng(0))

    def fail(*_: object) -> None:
        raise DetectorFileError("the network named class 7, counted from 0, but 6 names are known")

    with monkeypatch.context() as patch:
        patch.setattr("services.perception.detection.detector.Detector.detect", fail)
        (output,) = node.on_frame(good_frame(next(stamps)))
        assert output.topic is topics.FAULT
        assert "class 7" in output.message.detail
    after = node.on_frame(good_frame(next(stamps)))
    assert [output.topic for output in after] == [topics.DETECTIONS, topics.BODIES, topics.FOCUS]
