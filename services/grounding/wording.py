"""Turns of speech that point back: corrections, "the one", "it", "there is a ..."."""

import re

_correction = re.compile(
    r"^(?:(?:no|nope|wrong|sorry|actually|rather|instead|i meant?|not that(?: one)?)\b"
    r"[\s,.:;!-]*)+",
    re.IGNORECASE,
)
_the_one = re.compile(r"^(?:the|that) one\b", re.IGNORECASE)
_it = re.compile(r"\bit\b", re.IGNORECASE)
_it_is = re.compile(r"^(?:it'?s|it is|that'?s|that is)\s+", re.IGNORECASE)
_introduces = re.compile(
    r"^(?:there\b|an?\b|another\b|some\b|(?:i|we|you) (?:can )?(?:see|saw|have) an?\b)",
    re.IGNORECASE,
)
_prepositions = "to|over|up|down|toward|towards|behind|near|in|into|past|around|along|through"


def corrected(text: str) -> str | None:
    """What is left of a text without "no", "I mean" and the like; None if it has none of them.

    "The one behind the tree" corrects too: it points at something that was spoken of.
    """
    bare = text.strip()
    rest = _correction.sub("", bare)
    return rest if len(rest) < len(bare) or _the_one.match(rest) else None


def resolved(text: str, name: str) -> str:
    """The text with "the one" and "it" replaced by a thing's name."""
    return _it.sub(f"the {name}", _the_one.sub(f"the {name}", text))


def location(text: str) -> str:
    """An answer to "where is it?" without "it is"."""
    return _it_is.sub("", text.strip()).strip(" .!")


def introduces(text: str) -> bool:
    """Whether a statement speaks of a thing for the first time: "there is a hydrant"."""
    return _introduces.match(text.strip()) is not None


def substituted(text: str, words: dict[str, str]) -> str:
    """The text with single words replaced, whatever their case.

    Before a preposition a verb loses its own one: "zoom over to" is "go over to".
    """
    for word, known in words.items():
        pattern = rf"(?<!\w){re.escape(word)}(?!\w)"
        verb = known.partition(" ")[0]
        text = re.sub(rf"{pattern}(?=\s+(?:{_prepositions})\b)", verb, text, flags=re.IGNORECASE)
        text = re.sub(pattern, known, text, flags=re.IGNORECASE)
    return text
