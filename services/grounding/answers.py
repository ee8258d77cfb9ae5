"""What a short answer says about the question it belongs to, and about the readings."""

import re
from dataclasses import replace

from services.grounding.questions import Question
from services.grounding.understanding import Annotation, Intent, Understanding

RELIABILITY = 0.95
"""Probability that a person answers what is so."""

_YES = re.compile(
    r"(yes|yeah|yep|yup|y|sure|right|correct|exactly|ok|okay|please)\b[ ,.!]*"
    r"(please|it is|i do|that'?s right|right|exactly)?[ .!]*",
    re.IGNORECASE,
)
_NO = re.compile(
    r"(no|nope|n|wrong|neither|none)\b[ ,.!]*"
    r"(thanks|i don'?t|it isn'?t|of them|of these|thank you)?[ .!]*",
    re.IGNORECASE,
)
_ORDINALS = (("1", "first"), ("2", "second"), ("3", "third"), ("4", "fourth"))
_ORDINAL = re.compile(r"(?:the )?(\w+)(?: one)?[ .!]*", re.IGNORECASE)
_EMPTY_WORDS = frozenset({"the", "a", "an", "one", "that", "is", "it", "please"})
_ARTICLE = re.compile(r"^(?:it'?s|it is|i mean|mean)?\s*(?:a|an|the)?\s+", re.IGNORECASE)


def means_yes(text: str) -> bool:
    """Whether an answer is a plain yes."""
    return _YES.fullmatch(text.strip()) is not None


def means_no(text: str) -> bool:
    """Whether an answer is a plain no."""
    return _NO.fullmatch(text.strip()) is not None


def chosen(question: Question, text: str) -> str | None:
    """The meaning that an answer picks, None where it picks none or more than one."""
    meanings = question.meanings
    if means_yes(text):
        return meanings[0] if len(meanings) == 1 else None
    if means_no(text):
        return None
    bare = _ARTICLE.sub("", f" {text.strip()}").strip(" .!?\"'").lower()
    return _by_number(meanings, text) or _by_words(meanings, bare)


def _by_number(meanings: tuple[str, ...], text: str) -> str | None:
    match = _ORDINAL.fullmatch(text.strip())
    said = match.group(1).lower() if match else ""
    picks = [meaning for meaning, names in zip(meanings, _ORDINALS, strict=False) if said in names]
    return picks[0] if picks else None


def _by_words(meanings: tuple[str, ...], bare: str) -> str | None:
    """The one meaning that has all words of the answer, and not only such as all meanings have."""
    words = [frozenset(meaning.lower().split()) for meaning in meanings]
    if len(words) < 2:
        return bare if bare in meanings else None
    common = words[0].intersection(*words[1:])
    said = frozenset(bare.split()) - _EMPTY_WORDS
    fitting = [
        meaning
        for meaning, own in zip(meanings, words, strict=True)
        if said - common and said <= own
    ]
    return fitting[0] if len(fitting) == 1 else None


def reweighed(understanding: Understanding, asked: Intent, is_meant: bool) -> Understanding:
    """p(reading | text, question, answer), where the answer says whether `asked` is meant.

    All masses still sum to one.
    """
    hit, miss = (RELIABILITY, 1 - RELIABILITY) if is_meant else (1 - RELIABILITY, RELIABILITY)
    weighed = [
        replace(one, probability=one.probability * (hit if same(one, asked) else miss))
        for one in understanding.intents
    ]
    silent = understanding.statement_mass * miss
    left_out = understanding.other_mass * miss
    total = sum(one.probability for one in weighed) + silent + left_out
    if total <= 0.0:
        return understanding
    intents = [replace(one, probability=one.probability / total) for one in weighed]
    intents.sort(key=lambda one: -one.probability)
    annotations = [
        replace(one, probability=one.probability * (hit if _fits(one, asked) else miss))
        for one in understanding.annotations
    ]
    scale = (1.0 - left_out / total) / sum(one.probability for one in annotations)
    annotations = [replace(one, probability=one.probability * scale) for one in annotations]
    annotations.sort(key=lambda one: -one.probability)
    return replace(
        understanding,
        intents=tuple(intents),
        annotations=tuple(annotations),
        statement_mass=silent / total,
        other_mass=left_out / total,
    )


def same(one: Intent, other: Intent) -> bool:
    """Whether two readings ask for the same, however probable they are."""
    return replace(one, probability=0.0) == replace(other, probability=0.0)


def _fits(annotation: Annotation, asked: Intent) -> bool:
    fact = (asked.relation, asked.object, asked.landmark)
    placed = fact in annotation.relations or not any(
        figure == asked.object for _, figure, _ in annotation.relations
    )
    return asked.object in annotation.objects and placed
