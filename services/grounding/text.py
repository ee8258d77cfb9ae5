"""From raw text to lower-case words that remember where they stood."""

import re
from dataclasses import dataclass

_WORD = re.compile(r"[^\W_]+(?:['\u2019-][^\W_]+)*")
_CLITIC = re.compile(r"^(.+)['\u2019]s$")

MAX_WORDS = 40
"""Longest instruction that is parsed; the chart grows with the cube of the length."""


@dataclass(frozen=True)
class Token:
    """One word of the text."""

    text: str
    """Lower-case form with a straight apostrophe."""
    start: int
    """Offset of the first character in the raw text."""


def tokenize(text: str) -> tuple[Token, ...]:
    """Splits text into words; punctuation, emoji and control characters separate words."""
    tokens: list[Token] = []
    for match in _WORD.finditer(text):
        word = match.group().lower().replace("\u2019", "'")
        clitic = _CLITIC.match(word)
        tokens.append(Token(clitic.group(1) if clitic else word, match.start()))
        if clitic:
            tokens.append(Token("'s", match.end() - 2))
    return tuple(tokens)
