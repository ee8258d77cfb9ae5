"""Readings of what was said: annotations in the map's vocabulary.

Annotations are joint over all utterances that speak of the same things, so that the newest message
about an instruction carries the evidence of all of them. The relation that the instruction itself
is about becomes part of the hypotheses; the others stay with them as clues.
"""

from dataclasses import dataclass

import numpy as np

from schemas.language import Annotation, Annotations
from schemas.language import Relation as Said
from services.mapping import prior
from services.mapping.clues import Clue
from services.mapping.relation_table import enclosed_in, relation_named
from services.mapping.relations import Relation

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
    clues: tuple[Clue, ...] = ()
    """What else is said about the figure or the landmark."""
    not_meant: tuple[int, ...] = ()
    """Seen things that are not the figure."""
    enclosed: bool = False
    """Whether the figure lies in the landmark, so that only a look into that shows it."""


def readings_of(
    message: Annotations, vocabulary: tuple[str, ...], containers: tuple[str, ...] = ()
) -> tuple[Reading, ...]:
    """All readings whose classes the map knows; empty when the message is no evidence.

    The evidence of an utterance about another instruction is in that one's annotations.

    Args:
        message: what was said.
        vocabulary: classes of the map.
        containers: those of things that others may lie in.
    """
    if not message.understood or message.revises:
        return ()
    found = [
        _reading(annotation, message, vocabulary, containers) for annotation in message.annotations
    ]
    return tuple(reading for reading in found if reading)


def _reading(
    annotation: Annotation,
    message: Annotations,
    vocabulary: tuple[str, ...],
    containers: tuple[str, ...],
) -> Reading | None:
    wanted = [behavior.object for behavior in message.behaviors]
    stated = sorted(annotation.relations, key=lambda relation: _rank(relation, message))
    if stated:
        figure, name, landmark = stated[0].figure, stated[0].relation, stated[0].landmark
    else:
        named = [name for name in wanted if name in annotation.objects]
        figure, name, landmark = (named or list(annotation.objects) or [""])[0], None, None
    if figure not in vocabulary or (landmark is not None and landmark not in vocabulary):
        return None
    comparative = name is not None and _comparative(message, figure, name)
    enclosed = name == "inside" and landmark in containers
    return Reading(
        log_probability=float(np.log(max(annotation.probability, 1e-6))),
        figure=vocabulary.index(figure),
        relation=relation_named(enclosed_in if enclosed else name, comparative) if name else None,
        landmark=vocabulary.index(landmark) if landmark not in (None, robot_class) else None,
        comparative=comparative,
        clues=tuple(clue for other in stated[1:] if (clue := _clue(other, stated[0], vocabulary))),
        not_meant=message.not_meant,
        enclosed=enclosed,
    )


def _rank(relation: Said, message: Annotations) -> int:
    """Lower for what the instruction is about."""
    if not message.behaviors:
        return 0
    best = message.behaviors[0]
    if relation.figure != best.object:
        return 2
    return 0 if (relation.relation, relation.landmark) == (best.relation, best.landmark) else 1


def _clue(said: Said, main: Said, vocabulary: tuple[str, ...]) -> Clue | None:
    """A relation as a clue about the things of the main one; None if it is about others."""
    of_figure = main.figure in (said.figure, said.landmark)
    anchor = main.figure if of_figure else main.landmark
    if anchor not in (said.figure, said.landmark) or anchor == robot_class:
        return None
    other_is_landmark = said.figure == anchor
    other = said.landmark if other_is_landmark else said.figure
    if other not in vocabulary or other in (main.figure, main.landmark):
        return None
    return Clue(
        relation=relation_named(said.relation, comparative=False),
        of_figure=of_figure,
        other=None if other == robot_class else vocabulary.index(other),
        other_is_landmark=other_is_landmark,
        figure_radius=prior.typical_radius(said.figure),
        landmark_radius=prior.typical_radius(said.landmark),
    )


def _comparative(message: Annotations, figure: str, relation: str) -> bool:
    alike = [b for b in message.behaviors if (b.object, b.relation) == (figure, relation)]
    return bool(alike) and max(alike, key=lambda behavior: behavior.probability).comparative
