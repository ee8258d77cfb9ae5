"""Map hypotheses as the grounding sees them: columns of objects and a viewer."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from services.grounding.errors import GroundingError
from services.grounding.spatial import typical_offset
from services.grounding.symbols import ROBOT
from services.grounding.understanding import Annotation

IMPLIED_DISTANCE = 5.0
"""How far ahead the landmark of an implied map stands [m]."""
IMPLIED_EXTENT = 0.5
"""Edge of every object of an implied map [m]."""


@dataclass(frozen=True)
class WorldObjects:
    """The objects of one map hypothesis; N of them, in any order."""

    classes: NDArray[np.int64]
    """Index into the robot's object classes followed by its locations (N,)."""
    positions: NDArray[np.float64]
    """Centres in the world frame [m] (N, 3)."""
    extents: NDArray[np.float64]
    """Full edges of the bounding boxes [m] (N, 3)."""
    observed: NDArray[np.bool_]
    """False for objects that only language puts there (N,)."""
    viewer: NDArray[np.float64]
    """x, y [m] and heading [rad] of the robot in the world frame at the utterance (3,)."""

    def __post_init__(self) -> None:
        rows = len(self.classes)
        shapes = (self.positions.shape, self.extents.shape, self.observed.shape, self.viewer.shape)
        allowed = ((rows, 3), (rows, 3), (rows,), (3,))
        if shapes != allowed:
            raise GroundingError(
                f"positions, extents, observed, viewer have shapes {shapes}; allowed: {allowed}"
            )


def implied_world(annotation: Annotation, names: Sequence[str]) -> WorldObjects:
    """The simplest map in which an annotation holds, seen from the origin along +x.

    Args:
        annotation: what must hold; objects no relation places stand at the landmark distance.
        names: object classes followed by locations, what `classes` refers to.
    """
    rows: list[tuple[str, NDArray[np.float64]]] = []
    placed = {ROBOT: np.zeros(2)}
    for relation, figure, landmark in _landmarks_first(annotation):
        if landmark not in placed:
            placed[landmark] = _free_place(len(rows))
            rows.append((landmark, placed[landmark]))
        where = placed[landmark] + typical_offset(relation, landmark == ROBOT)
        rows.append((figure, where))
        placed.setdefault(figure, where)
    for name in annotation.objects:
        if name not in placed:
            rows.append((name, _free_place(len(rows))))
    count = len(rows)
    return WorldObjects(
        classes=np.array([names.index(name) for name, _ in rows], dtype=np.int64),
        positions=np.array([[*at, 0.0] for _, at in rows]).reshape(count, 3),
        extents=np.full((count, 3), IMPLIED_EXTENT),
        observed=np.zeros(count, dtype=np.bool_),
        viewer=np.zeros(3),
    )


def _landmarks_first(annotation: Annotation) -> list[tuple[str, str, str]]:
    """Relations ordered so that a landmark that is itself placed by a relation is placed before."""
    figures = {figure for _, figure, _ in annotation.relations}
    return sorted(annotation.relations, key=lambda one: one[2] in figures)


def _free_place(row: int) -> NDArray[np.float64]:
    """A place ahead of the robot that no earlier row took (2,)."""
    return np.array([IMPLIED_DISTANCE, 4.0 * row])
