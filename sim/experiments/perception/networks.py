"""The network that is judged: ours, or those that a person names."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from services.perception.detection.bank import DetectorBank, FindsObjects, user_detectors
from services.perception.detection.detector import Detector, default_weights

LOWEST_SCORE = 0.02
"""Average precision needs the whole curve, not only the boxes that the robot acts on."""


@dataclass(frozen=True)
class Networks:
    """The same networks twice."""

    working: FindsObjects
    """As the robot runs them."""
    faint: FindsObjects
    """With the boxes that lie below their working threshold."""
    parts: Sequence[Detector]
    """Those of `working`, one by one."""
    told: tuple[str, ...]
    """What they are, one line each."""


def networks_of(weights: Sequence[str], class_files: Sequence[str]) -> Networks:
    """The networks in files; ours without files.

    Raises:
        DetectorFileError: a file cannot be used.
        MissingWeightsError: our own weights or their card are missing or do not belong together.
    """
    if not weights:
        ours = Detector()
        told = f"{Path(default_weights).name}: threshold {ours.threshold:.2f}"
        return Networks(ours, Detector(threshold=LOWEST_SCORE), [ours], (told,))
    parts = user_detectors(weights, class_files)
    faint = user_detectors(weights, class_files, LOWEST_SCORE)
    told = tuple(f"{one.description}; threshold {one.threshold:.2f}" for one in parts)
    return Networks(DetectorBank(parts), DetectorBank(faint), parts, told)
