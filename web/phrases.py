"""Symbols in plain words."""

from schemas.language import Annotation, BehaviorSymbol, Relation

_relation_words = {
    "back": "behind",
    "front": "in front of",
    "left": "left of",
    "right": "right of",
    "near": "near",
    "away": "away from",
    "inside": "inside",
    "unknown": "",
}


def relation_phrase(relation: Relation) -> str:
    """For example "hydrant behind cone"."""
    word = _relation_words.get(relation.relation, relation.relation)
    return f"{relation.figure} {word} {relation.landmark}"


def reading(annotation: Annotation) -> str:
    """What one annotation says about the world."""
    related = {name for r in annotation.relations for name in (r.figure, r.landmark)}
    alone = [name for name in annotation.objects if name not in related]
    parts = [relation_phrase(r) for r in annotation.relations] + [f"a {name}" for name in alone]
    return ", ".join(parts) or "nothing about the world"


def intention(behavior: BehaviorSymbol) -> str:
    """What one behaviour makes the robot do."""
    action = "go to" if behavior.action == "navigate" else behavior.action
    words = [action, behavior.object]
    if behavior.relation != "unknown":
        near = "nearest to" if behavior.comparative else _relation_words.get(behavior.relation)
        words += [near or behavior.relation, behavior.landmark]
    if behavior.mode != "unknown":
        words.append(behavior.mode)
    return " ".join(word for word in words if word and word != "unknown")


def direction(bearing_degrees: float) -> str:
    """A bearing in the base frame as a person says it, counter-clockwise from ahead."""
    names = (
        "ahead",
        "ahead left",
        "to the left",
        "behind left",
        "behind",
        "behind right",
        "to the right",
        "ahead right",
    )
    return names[round(bearing_degrees / 45.0) % 8]
