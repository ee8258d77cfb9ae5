"""The process that recognises places: camera frames in, kinds of places and tags out."""

from collections.abc import Iterable

import msgspec
import numpy as np

from robots.catalogue import get_robot
from robots.tags import place_types, tag_table
from schemas import topics
from schemas.perception import Fiducials, SceneObservation
from schemas.run import RunConfig
from schemas.sensing import RgbdFrame
from schemas.topics import Handlers, Output
from services.perception.fiducials import TagReader, fiducials_in, place_rows
from services.perception.places.classifier import PlaceClassifier, scene_in

_period_ns = 400_000_000
"""Looks from the same spot are no new evidence: two or three a second are enough."""


class ScenesNode:
    """Says what kinds of places a frame shows, by their looks and by tags.

    Raises:
        TagTableError: the run names a table of tags that cannot be used.
        MissingWeightsError: the classifier's weights are missing.
    """

    def __init__(self, run: RunConfig, rng: np.random.Generator) -> None:
        del rng
        robot = get_robot(run.robot)
        self._types, self._table = place_types(robot), tag_table(run, robot)
        self._classifier, self._tags = PlaceClassifier(), TagReader()
        self._due_ns: int | None = None

    def handlers(self) -> Handlers:
        """Camera frames, and nothing else."""
        return {topics.RGBD: self.on_frame}

    def on_frame(self, frame: RgbdFrame) -> Iterable[Output]:
        """One `SceneObservation` for every frame that is due, and `Fiducials` where there are."""
        if self._due_ns is not None and 0 < self._due_ns - frame.stamp_ns <= _period_ns:
            return
        self._due_ns = frame.stamp_ns + _period_ns
        tags = fiducials_in(frame, self._tags, self._table.side_m)
        if len(tags.ids):
            yield topics.FIDUCIALS.of(tags)
        yield topics.SCENE.of(self._scene(frame, tags))

    def _scene(self, frame: RgbdFrame, tags: Fiducials) -> SceneObservation:
        """Looks and tags in one message: the reader takes one for every stamp."""
        seen = scene_in(frame, self._classifier, self._types)
        points, rows = place_rows(tags, self._table, self._types)
        return msgspec.structs.replace(
            seen,
            points_base=np.concatenate([seen.points_base, points]),
            probabilities=np.concatenate([seen.probabilities, rows]),
        )
