"""A person who knows where everything is, and answers the robot's first question."""

from collections.abc import Iterable

from robots.catalogue import get_robot
from schemas import topics
from schemas.language import Annotations, Answer
from schemas.run import RunConfig
from schemas.topics import Handlers, Output
from services.process_table import Process
from sim.experiments.arms import Truthful
from sim.oracle import Oracle
from sim.world import make_world

USER = Process(
    name="user",
    node="sim.experiments.simulated_user:SimulatedUser",
    latency_ms=2000.0,
    listens=(topics.ANNOTATIONS,),
    publishes=(topics.ANSWER,),
    purpose="answers after two seconds",
)
_places = {"back": "behind", "front": "in front of", "left": "left of", "right": "right of"}


class SimulatedUser:
    """Picks the option that names what is meant, or says where it is.

    Args:
        run: names the world.
        intended: ids of what is meant; the first one is asked about.
        truth: where the robot really is.
    """

    def __init__(self, run: RunConfig, intended: tuple[str, ...], truth: Truthful) -> None:
        world, body = make_world(run.world, run.seed), get_robot(run.robot).base
        self._oracle = Oracle(world, body, truth.world_from_base)
        self._intended = intended[0]
        self._label = world.find(self._intended).label
        self._has_answered = False

    def handlers(self) -> Handlers:
        """What the robot understood, and asks."""
        return {topics.ANNOTATIONS: self.on_annotations}

    def on_annotations(self, annotations: Annotations) -> Iterable[Output]:
        """Answer once."""
        if self._has_answered or annotations.question is None:
            return
        self._has_answered = True
        yield topics.ANSWER.of(
            Answer(
                stamp_ns=annotations.stamp_ns,
                instruction_id=annotations.instruction_id,
                text=self._answer(annotations.options),
                source="simulated user",
            )
        )

    def _answer(self, options: tuple[str, ...]) -> str:
        if not options:
            return self._place()
        if options == ("yes", "no"):
            return "yes" if self._in_sight() == self._intended else "no"
        named = [option for option in options if self._named(option) == self._intended]
        return named[0] if named else next(one for one in options if " other " in one)

    def _place(self) -> str:
        """Where the thing is, in words that fit no other of its class."""
        landmarks = [one for one in self._oracle.objects if one.label != self._label]
        for landmark in landmarks:
            for relation, words in _places.items():
                fitting = self._oracle.satisfying(self._label, relation, landmark.id)
                if fitting == (self._intended,):
                    return f"{words} the {landmark.label}"
        return f"near the {landmarks[0].label}"

    def _in_sight(self) -> str:
        """What the robot must be looking at: the nearest one to it."""
        alike = [one.id for one in self._oracle.objects if one.label == self._label]
        return min(alike, key=self._oracle.distance_to)

    def _named(self, option: str) -> str:
        """What "go to the hydrant near the cone" names, "" where no landmark is named."""
        landmark = option.rpartition(" near the ")[2]
        beside = [one.id for one in self._oracle.objects if one.label == landmark]
        return self._oracle.nearest(self._label, beside[0]) if beside else ""
