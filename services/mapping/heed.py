"""What a picture was searched for: a missing detection is evidence about these classes alone."""

from collections.abc import Iterable

import numpy as np

from schemas.arrays import Flags
from schemas.perception import Detections
from services.mapping.annotations import Reading


def sought_in(detections: Detections, vocabulary: tuple[str, ...]) -> Flags:
    """(C,) Whether things of each class of the map were looked for."""
    passed_over = {name if name in vocabulary else "unknown" for name in detections.unsought}
    return np.array([name not in passed_over for name in vocabulary])


def asked_for(readings: Iterable[Reading]) -> frozenset[int]:
    """Classes that readings speak of: whose hypotheses a picture can speak against."""
    named = {index for one in readings for index in (one.figure, one.landmark)}
    named |= {clue.other for one in readings for clue in one.clues}
    return frozenset(index for index in named if index is not None)
