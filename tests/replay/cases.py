"""What is replayed: each case is one file of what one service heard, and said to it."""

from dataclasses import dataclass, field
from pathlib import Path

from schemas import topics
from schemas.run import RunConfig
from schemas.topics import Topic
from services.process_table import process_named

LOGS = Path(__file__).parent / "logs"

_husky = RunConfig(robot="husky", world="hydrant", seed=6, particles=50)
_chair = RunConfig(robot="wheelchair", world="office", seed=5001, particles=50)
_arm = RunConfig(robot="husky_ur5", world="box_indoor", seed=3, particles=20)
_behind = "go to the hydrant behind the cone"
_kitchen = "go to the kitchen that is down the hallway"
_ball = "retrieve the ball inside the box"


@dataclass(frozen=True)
class Case:
    """One service in one episode."""

    name: str
    service: str
    run: RunConfig
    text: str
    seconds: float
    """Length of the episode that the inputs come from [s]."""
    drawn: bool = True
    """Whether its pictures are rendered; else perception is modelled."""
    every: dict[Topic, int] = field(default_factory=dict)
    """Of these topics every n-th message alone, because they are large."""

    @property
    def path(self) -> Path:
        return LOGS / f"{self.name}.mcap"

    @property
    def process(self):
        return process_named(self.service)


CASES = (
    Case("grounding", "grounding", _husky, _behind, 12.0),
    Case("mapping", "mapping", _husky, _behind, 8.0),
    Case("mapping-places", "mapping", _chair, _kitchen, 8.0, drawn=False),
    Case("policy", "policy", _husky, _behind, 12.0),
    Case("policy-places", "policy", _chair, _kitchen, 8.0, drawn=False),
    Case("policy-arm", "policy", _arm, _ball, 25.0, drawn=False),
    Case("perception", "perception", _husky, _behind, 11.0, every={topics.RGBD: 25}),
    Case("navigation", "navigation", _husky, _behind, 12.0),
)
