"""The document that `ground --json` prints."""

from dataclasses import asdict
from typing import Any

from services.grounding.model import BehaviorDistribution
from services.grounding.understanding import Annotation, Understanding


def document(
    robot: str,
    understanding: Understanding,
    behaviors: BehaviorDistribution,
    elapsed_ms: float,
) -> dict[str, Any]:
    """The keys and values of the contract; distributions best first.

    Args:
        robot: name of the robot.
        understanding: of the text.
        behaviors: grounded in the map that the best annotation implies.
        elapsed_ms: time that both took, measured by the caller [ms].
    """
    return {
        "text": understanding.text,
        "robot": robot,
        "understood": understanding.understood,
        "parse": understanding.parse,
        "parse_probability": understanding.parse_probability,
        "annotations": [_annotation(one) for one in understanding.annotations],
        "behaviors": [
            {key: value for key, value in asdict(one).items() if key in _BEHAVIOR_KEYS}
            for one in behaviors.behaviors
        ],
        "unknown_words": list(understanding.unknown_words),
        "question": understanding.question,
        "elapsed_ms": elapsed_ms,
    }


_BEHAVIOR_KEYS = ("probability", "action", "object", "mode", "relation", "landmark")


def _annotation(annotation: Annotation) -> dict[str, Any]:
    relations = [
        {"relation": relation, "figure": figure, "landmark": landmark}
        for relation, figure, landmark in annotation.relations
    ]
    return {
        "probability": annotation.probability,
        "objects": list(annotation.objects),
        "relations": relations,
    }


def describe(understanding: Understanding, behaviors: BehaviorDistribution) -> str:
    """The same for a person."""
    if not understanding.understood:
        words = ", ".join(understanding.unknown_words) or "nothing in it can be done"
        possible = "\n".join(f"  {line}" for line in understanding.possible)
        return f"not understood: {words}\n{understanding.question}\npossible:\n{possible}"
    lines = [f"parse {understanding.parse_probability:.2f}: {understanding.parse}"]
    for one in understanding.annotations[:3]:
        relations = ", ".join(f"{f} {r} {m}" for r, f, m in one.relations)
        lines.append(f"says {one.probability:.2f}: {', '.join(one.objects)}; {relations}")
    for behavior in behaviors.behaviors[:3]:
        wanted = f"{behavior.action} to {behavior.object}"
        place = f"{behavior.relation} {behavior.landmark}"
        lines.append(f"wants {behavior.probability:.2f}: {wanted}; {place}; {behavior.mode}")
    return "\n".join([*lines, understanding.question or ""]).rstrip()
