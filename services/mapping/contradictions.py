"""What an utterance says that cannot be, or that this map cannot hold."""

from itertools import combinations

from schemas.language import Annotations, Relation
from services.mapping.annotations import robot_class

_opposites = (
    frozenset({"left", "right"}),
    frozenset({"front", "back"}),
    frozenset({"near", "away"}),
    frozenset({"inside", "away"}),
)


def doubts_about(message: Annotations, classes: tuple[str, ...]) -> list[tuple[str, str]]:
    """(kind of fault, in words) of all that is wrong with the likeliest reading."""
    if not message.understood or not message.annotations:
        return []
    best = max(message.annotations, key=lambda annotation: annotation.probability)
    doubts = [("contradiction", told) for told in _contradictions(best.relations)]
    named = {name for one in best.relations for name in (one.figure, one.landmark)}
    for name in sorted((named | set(best.objects)) - set(classes) - {robot_class}):
        doubts.append(("unknown class", f"the map knows no {name!r}; it knows: {_list(classes)}"))
    return doubts


def _contradictions(relations: tuple[Relation, ...]) -> list[str]:
    return [
        f"the {one.figure} is said to be {one.relation!r} and {other.relation!r} of the "
        f"{one.landmark}: the first is believed"
        for one, other in combinations(relations, 2)
        if (one.figure, one.landmark) == (other.figure, other.landmark)
        and frozenset({one.relation, other.relation}) in _opposites
    ]


def _list(names: tuple[str, ...]) -> str:
    return ", ".join(names)
