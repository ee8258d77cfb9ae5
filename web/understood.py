"""The panel that tells how an instruction was understood and what came of it."""

import re

from robots.colours import BLUE, GREEN, GREY, VERMILLION, Rgb, class_colour
from schemas.language import Annotations, BehaviorSymbol, Instruction
from schemas.task import Decision, InstructionStatus, TaskState
from web import markup
from web.phrases import intention, reading

_leaf = re.compile(r"\(([^()\s]+) ([^()\s]+)\)")
_readings_shown = 4
_smallest_shown = 0.005
_state_colours: dict[TaskState, Rgb] = {
    TaskState.ACTIVE: markup.CALM,
    TaskState.SUCCEEDED: markup.GOOD,
    TaskState.FAILED: markup.BAD,
    TaskState.CANCELLED: markup.QUIET,
}
_plain: Rgb = (222, 225, 230)
_nobody_said = "Type an instruction above, for example: go to the hydrant behind the cone"


def understood_html(
    instruction: Instruction | None,
    annotations: Annotations | None,
    status: InstructionStatus | None,
    decision: Decision | None,
) -> str:
    """The whole panel; every argument may still be missing.

    What belongs to an earlier instruction is left out.
    """
    if instruction is None and annotations is None:
        return markup.padded(markup.paragraph(_nobody_said))
    if instruction and annotations and _is_older(annotations, instruction):
        annotations = None
    about = annotations.instruction_id if annotations else instruction.id if instruction else ""
    if status and status.instruction_id != about:
        status = None
    parts: list[str] = []
    if status:
        parts.append(_status(status))
    if status and decision and _is_news(decision, status):
        parts.append(markup.heading("Doing now") + markup.paragraph(decision.reason))
    if annotations:
        parts.append(_meaning(annotations))
    elif instruction:
        parts += [markup.heading("You said"), markup.paragraph(instruction.text)]
        parts.append(markup.paragraph("Trying to understand it …", markup.QUIET))
    return markup.padded(*parts)


def _is_older(annotations: Annotations, instruction: Instruction) -> bool:
    """Whether they were made before it was said; it may also have revised an earlier one."""
    same = annotations.instruction_id == instruction.id
    return not same and annotations.stamp_ns < instruction.stamp_ns


def _is_news(decision: Decision, status: InstructionStatus) -> bool:
    return status.state is TaskState.ACTIVE and decision.reason != status.reason


def word_roles(annotations: Annotations) -> list[tuple[str, str, Rgb]]:
    """Each word of the utterance with the role it plays and the colour of that role."""
    behavior = annotations.behaviors[0] if annotations.behaviors else None
    tagged = [(word, tag) for tag, word in _leaf.findall(annotations.parse)]
    if not tagged:
        tagged = [(word, "") for word in annotations.text.split()]
    unknown = {word.lower() for word in annotations.unknown_words}
    return [(word, *_role(word, tag, unknown, behavior)) for word, tag in tagged]


def _role(
    word: str, tag: str, unknown: set[str], behavior: BehaviorSymbol | None
) -> tuple[str, Rgb]:
    name = word.lower()
    if name.strip(".,!?") in unknown:
        return "unknown", VERMILLION
    if behavior and name == behavior.object:
        return "goal", class_colour(name)
    if behavior and name == behavior.landmark:
        return "landmark", class_colour(name)
    if tag.startswith("VB"):
        return "action", BLUE
    if tag.startswith("NN"):
        return "thing", GREY
    return ("relation", GREEN) if tag.startswith(("IN", "JJ")) else ("", _plain)


def _status(status: InstructionStatus) -> str:
    badge = markup.pill(status.state.upper(), _state_colours[status.state])
    return markup.heading("Instruction") + markup.flow([badge, markup.paragraph(status.reason)])


def _meaning(annotations: Annotations) -> str:
    words = "".join(markup.word(*entry) for entry in word_roles(annotations))
    parts = [markup.heading("How I understood it"), f"<div>{words}</div>"]
    if not annotations.understood:
        parts += _not_understood(annotations)
    if annotations.question:
        parts += [markup.heading("Question"), markup.paragraph(annotations.question)]
    if annotations.annotations:
        parts += [markup.heading("What it says about the world"), _readings(annotations)]
    if annotations.behaviors:
        parts += [markup.heading("What it asks me to do"), _intentions(annotations)]
    return "".join(parts)


def _not_understood(annotations: Annotations) -> list[str]:
    unknown = ", ".join(annotations.unknown_words)
    complaint = f"I do not know: {unknown}" if unknown else "I do not understand this."
    parts = [markup.paragraph(complaint, markup.BAD)]
    if annotations.possible:
        parts += [markup.heading("You can say")]
        parts += [markup.paragraph(f"• {text}") for text in annotations.possible]
    return parts


def _readings(annotations: Annotations) -> str:
    return "".join(
        markup.bar(reading(a), a.probability, class_colour(a.objects[-1] if a.objects else ""))
        for a in annotations.annotations[:_readings_shown]
        if a.probability >= _smallest_shown
    )


def _intentions(annotations: Annotations) -> str:
    return "".join(
        markup.bar(intention(b), b.probability, class_colour(b.object))
        for b in annotations.behaviors[:_readings_shown]
        if b.probability >= _smallest_shown
    )
