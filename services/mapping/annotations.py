"""Readings of an utterance: annotations in the map's vocabulary."""

from dataclasses import dataclass

import numpy as np

from schemas.language import Annotation, Annotations
from services.mapping.relations import Relation, relation_named

robot_class = "robot"


@dataclass(frozen=True)
class Reading:
    """One thing that the utterance may say about the world."""

    log_probability: float
    figure: int
    """Class index."""
    relation: Relation | None
    """None when the utterance only says that the figure exists."""
    landmark: int | None
    """Class index; None without a relation, and when the landmark is the robot itself."""
    comparative: bool
    """No other thing of the figure's class stands nearer to the landmark."""


def readings_of(message: Annotations, vocabulary: tuple[str, ...]) -> tuple[Reading, ...]:
    """All readings whose classes the map knows; empty when the message is no evidence."""
    if not message.understood:
        return ()
    found = [_reading(annotation, message, vocabulary) for annotation in message.annotations]
    return tuple(reading for reading in found if reading)


def _reading(
    annotation: Annotation, message: Annotations, vocabulary: tuple[str, ...]
) -> Reading | None:
    wanted = [behavior.object for behavior in message.behaviors]
    stated = sorted(annotation.relations, key=lambda relation: relation.figure not in wanted[:1])
    if stated:
        figure, name, landmark = stated[0].figure, stated[0].relation, stated[0].landmark
    else:
        named = [name for name in wanted if name in annotation.objects]
        figure, name, landmark = (named or list(annotation.objects) or [""])[0], None, None
    if figure not in vocabulary or (landmark is not None and landmark not in vocabulary):
        return None
    comparative = name is not None and _comparative(message, figure, name)
    return Reading(
        log_probability=float(np.log(max(annotation.probability, 1e-6))),
        figure=vocabulary.index(figure),
        relation=relation_named(name, comparative) if name else None,
        landmark=vocabulary.index(landmark) if landmark not in (None, robot_class) else None,
        comparative=comparative,
    )


def _comparative(message: Annotations, figure: str, relation: str) -> bool:
    alike = [b for b in message.behaviors if (b.object, b.relation) == (figure, relation)]
    return bool(alike) and max(alike, key=lambda behavior: behavior.probability).comparative
