"""The detector's network in OpenCV, beside the same file in onnxruntime, all on one thread."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import onnxruntime
from numpy.typing import NDArray

from services.perception.detection.boxes import Boxes
from services.perception.detection.detector import Detector, default_weights
from services.perception.detection.picture import network_input
from tests.benchmarks.rows import Row, compared
from tests.benchmarks.timing import interleaved

RUNTIME = f"onnxruntime {onnxruntime.__version__}"
PLAIN_RUNTIME = f"{RUNTIME} without graph optimisation"

_frame = Path(__file__).parents[1] / "data" / "perception_frame.npz"
_drift = 2.0
_most_px, _most_score = 0.1, 0.002
"""The largest differences that no user of a box would notice."""


class Session:
    """onnxruntime on one thread."""

    def __init__(self, *, optimised: bool) -> None:
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        if not optimised:
            options.graph_optimization_level = onnxruntime.GraphOptimizationLevel.ORT_DISABLE_ALL
        self._session = onnxruntime.InferenceSession(
            default_weights, options, providers=["CPUExecutionProvider"]
        )
        self._input: str = self._session.get_inputs()[0].name

    def __call__(self, blob: NDArray[np.float32]) -> list[NDArray[np.float32]]:
        """Outputs for one blob."""
        return [np.asarray(output) for output in self._session.run(None, {self._input: blob})]


def measure(rounds: int) -> list[Row]:
    """Speed from picture to boxes, and how far the boxes are from those of the peers."""
    detector = Detector()
    peers = {RUNTIME: Session(optimised=True), PLAIN_RUNTIME: Session(optimised=False)}
    pictures = _pictures()
    spent = interleaved(
        {
            "ours": lambda: detector.detect(pictures[0]),
            **{
                name: lambda run=run: _detect(detector, run, pictures[0])
                for name, run in peers.items()
            },
        },
        rounds,
    )
    speeds = [
        compared(
            "detector 320x240",
            "per frame",
            "ms",
            1e3 * spent["ours"],
            (name, 1e3 * spent[name]),
            drift=_drift,
        )
        for name in peers
    ]
    return speeds + _agreement(pictures, detector, peers)


def _pictures() -> list[NDArray[np.uint8]]:
    with np.load(_frame) as arrays:
        color: NDArray[np.uint8] = arrays["color"]
    return [color, np.ascontiguousarray(color[:, ::-1]), color // 2]


def _detect(detector: Detector, run: Session, color: NDArray[np.uint8]) -> Boxes:
    height, width = color.shape[:2]
    return detector.read(run(network_input(color)), width, height)


def _agreement(
    pictures: list[NDArray[np.uint8]], detector: Detector, peers: Mapping[str, Session]
) -> list[Row]:
    ours = [detector.detect(picture) for picture in pictures]
    assert all(len(boxes.scores) for boxes in ours), "nothing to agree about"
    rows: list[Row] = []
    for name, run in peers.items():
        theirs = [_detect(detector, run, picture) for picture in pictures]
        corners = _largest(
            [(a.corners_px, b.corners_px) for a, b in zip(ours, theirs, strict=True)]
        )
        scores = _largest(
            [(a.class_scores, b.class_scores) for a, b in zip(ours, theirs, strict=True)]
        )
        rows += [
            _difference(f"corners from {name}", "px", corners, _most_px),
            _difference(f"scores from {name}", "1", scores, _most_score),
        ]
    return rows


def _largest(pairs: list[tuple[NDArray[np.float64], NDArray[np.float64]]]) -> float:
    """Largest difference over all boxes; infinite if one found more boxes than the other."""
    if any(a.shape != b.shape for a, b in pairs):
        return float("inf")
    return max(float(np.abs(a - b).max()) for a, b in pairs)


def _difference(what: str, unit: str, largest: float, most: float) -> Row:
    return Row(
        row=f"detector {what}",
        metric="largest difference",
        unit=unit,
        better="lower",
        ours=largest,
        interval=(largest, largest),
        limit=most,
    )
