"""The map as it grew: floor, what was seen, what is guessed, the way and the goal, from above."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from schemas import topics
from schemas.belief import MapBelief, OccupancyGrid
from schemas.geometry import Pose2
from schemas.task import Decision, Goal, GoalStatus
from services.recorder.export.map_picture import Window, draw_map
from services.recorder.export.pace import evenly
from services.runtime.log_file import read_messages

PERIOD_S = 0.5
"""Between pictures, in the time of the run."""
SHOWN_S = 0.1
"""How long each is shown."""
_margin_m = 2.0
_smallest_m = 8.0


@dataclass
class Scene:
    """The newest of everything that is drawn."""

    belief: MapBelief | None = None
    grid: OccupancyGrid | None = None
    decision: Decision | None = None
    goal: Goal | None = None
    status: GoalStatus | None = None
    odom_from_base: Pose2 | None = None
    text: str = ""

    def take(self, message: Any, topic: topics.Topic[Any]) -> None:
        """One more message."""
        if topic is topics.ODOMETRY:
            self.odom_from_base = message.odom_from_base
        elif topic is topics.INSTRUCTION:
            self.text = message.text
        else:
            setattr(self, _fields[topic.key], message)


_fields = {
    topics.BELIEF.key: "belief",
    topics.GRID.key: "grid",
    topics.DECISION.key: "decision",
    topics.GOAL.key: "goal",
    topics.GOAL_STATUS.key: "status",
}
_drawn = (
    topics.ODOMETRY,
    topics.INSTRUCTION,
    topics.BELIEF,
    topics.GRID,
    topics.DECISION,
    topics.GOAL,
    topics.GOAL_STATUS,
)


def map_film(log: Path) -> Iterator[Image.Image]:
    """A picture every `PERIOD_S` of the run.

    Raises:
        LogError: not a readable log.
    """
    window, first_ns = _window(log), None
    for log_ns, scene in evenly(_scenes(log), round(1e9 * PERIOD_S)):
        first_ns = log_ns if first_ns is None else first_ns
        if scene.belief is not None:
            yield draw_map(window, scene, (log_ns - first_ns) / 1e9)


def write_gif(log: Path, target: Path) -> int:
    """Write the film of the map.

    Returns:
        Number of pictures.

    Raises:
        LogError: not a readable log, or one without a map.
    """
    pictures = [picture.quantize(64) for picture in map_film(log)]
    if pictures:
        pictures[0].save(
            target,
            "GIF",
            save_all=True,
            append_images=pictures[1:],
            duration=round(1000 * SHOWN_S),
            loop=0,
        )
    return len(pictures)


def _scenes(log: Path) -> Iterator[tuple[int, tuple[int, Scene]]]:
    """The scene after each odometry."""
    scene = Scene()
    for log_ns, topic, message in read_messages(log, _drawn):
        scene.take(message, topic)
        if topic is topics.ODOMETRY:
            yield log_ns, (log_ns, replace(scene))


def _window(log: Path) -> Window:
    """Around everywhere the robot was and thought of going, and what it saw."""
    low, high = np.full(2, np.inf), np.full(2, -np.inf)
    for _, topic, message in read_messages(log, (topics.BELIEF, topics.DECISION)):
        if topic is topics.DECISION:
            points = message.positions[[message.chosen]]
        else:
            points = np.vstack([message.trajectory[:, :2], message.position[message.seen]])
        low = np.minimum(low, points.min(axis=0, initial=np.inf))
        high = np.maximum(high, points.max(axis=0, initial=-np.inf))
    if not np.isfinite(low).all():
        low = high = np.zeros(2)
    middle = (low + high) / 2
    half = np.maximum((high - low) / 2 + _margin_m, _smallest_m / 2)
    return Window(tuple((middle - half).tolist()), tuple((middle + half).tolist()))
