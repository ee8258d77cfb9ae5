"""From raw text to lower-case words that remember where they stood."""

import re
from dataclasses import dataclass

_WORD = re.compile(r"[^\W_]+(?:['\u2019-][^\W_]+)*")
_CLITIC = re.compile(r"^(.+)('(?:s|ll|re|ve|d|m))$")

MAX_WORDS = 40
"""Longest instruction that is parsed whole; the chart grows with the cube of the length."""


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
        start = match.start()
        for part in split_clitic(match.group().lower().replace("\u2019", "'")):
            tokens.append(Token(part, start))
            start += len(part)
    return tuple(tokens)


def split_clitic(word: str) -> tuple[str, ...]:
    """Parts "you'll" into "you" and "'ll"; other words stay whole."""
    clitic = _CLITIC.match(word)
    return clitic.groups() if clitic else (word,)
