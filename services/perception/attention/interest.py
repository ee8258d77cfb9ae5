"""What instructions need to see: the classes that their annotations name."""

from schemas.language import Annotations
from schemas.task import InstructionStatus, TaskState

_least_probability = 0.02
"""Of a reading: what it names is looked for, however unlikely it is that it was meant."""
_nameless = ("", "robot")
_anything = "unknown"
"""Of a thing: that it may be any; of a relation: that none was meant, nor its landmark."""


class Interest:
    """Follows which instruction is in hand, and what that one is about.

    Args:
        classes: that the networks know.
        places: words for places; these are not recognised among objects.
    """

    def __init__(self, classes: tuple[str, ...], places: tuple[str, ...]) -> None:
        self._classes, self._places = classes, places
        self._needs: dict[str, frozenset[str]] = {}
        self._ended: set[str] = set()
        self._current = ""

    @property
    def wanted(self) -> frozenset[str]:
        """Classes that matter now; all where they cannot be narrowed, none without instruction."""
        return self._needs.get(self._current, frozenset())

    def hear(self, annotations: Annotations) -> None:
        """Attend to an instruction as it is understood now."""
        name = annotations.instruction_id
        if name not in self._ended:
            self._needs[name] = self._needed(annotations)
            self._current = name

    def follow(self, status: InstructionStatus) -> None:
        """Attend to the instruction that is being followed, and to none that has ended."""
        name = status.instruction_id
        if status.state is TaskState.ACTIVE:
            self._current = name
            return
        self._ended.add(name)
        self._needs.pop(name, None)

    def _needed(self, annotations: Annotations) -> frozenset[str]:
        names = named_in(annotations).difference(_nameless, self._places)
        # A word that no network knows by this name may stand for anything that one does know.
        narrow = names <= frozenset(self._classes) - {_anything}
        return names if narrow else frozenset(self._classes)


def named_in(annotations: Annotations) -> frozenset[str]:
    """All that is spoken of, in any reading that is not out of the question."""
    names: set[str] = set()
    for reading in annotations.annotations:
        if reading.probability >= _least_probability:
            names.update(reading.objects)
            names.update(name for one in reading.relations for name in (one.figure, one.landmark))
    for behavior in annotations.behaviors:
        if behavior.probability >= _least_probability:
            related = behavior.relation != _anything
            names.update((behavior.object, behavior.landmark if related else ""))
    return frozenset(names)
