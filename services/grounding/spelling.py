"""Known words one typing slip away from a word as written."""

from collections.abc import Iterable
from dataclasses import dataclass

MIN_CORRECTED_LETTERS = 5
"""Shorter words have too many neighbours at distance one to be corrected."""
MAX_CORRECTED_LETTERS = 24


@dataclass(frozen=True)
class Spelling:
    """A vocabulary indexed by its words with one letter left out.

    Two words one slip apart have a form in common, so that a look-up need not see every word.
    """

    words: frozenset[str]
    by_shortened: dict[str, tuple[str, ...]]

    @classmethod
    def of(cls, words: Iterable[str]) -> "Spelling":
        """Indexes a vocabulary."""
        known = frozenset(words)
        found: dict[str, tuple[str, ...]] = {}
        for word in sorted(word for word in known if _is_correctable(word)):
            for form in shortened(word):
                found[form] = (*found.get(form, ()), word)
        return cls(known, found)

    def of_word(self, word: str) -> tuple[str, ...]:
        """The word itself if it is known or resembles none, otherwise its likely spellings."""
        if word in self.words or not _is_correctable(word):
            return (word,)
        single = {word[:at] + word[at + 1 :] for at in range(1, len(word)) if _is_double(word, at)}
        near = {known for form in shortened(word) for known in self.by_shortened.get(form, ())}
        slips = {known for known in near if is_one_slip(word, known)} | single & self.words
        return tuple(sorted(slips)) or (word,)


def _is_double(word: str, at: int) -> bool:
    return word[at] == word[at - 1]


def _is_correctable(word: str) -> bool:
    return MIN_CORRECTED_LETTERS <= len(word) <= MAX_CORRECTED_LETTERS


def shortened(word: str) -> set[str]:
    """The word and all its forms with one letter left out."""
    return {word, *(word[:at] + word[at + 1 :] for at in range(len(word)))}


def is_one_slip(a: str, b: str) -> bool:
    """Whether the Damerau distance of two different words is one."""
    if abs(len(a) - len(b)) > 1 or a == b:
        return False
    start = 0
    while start < min(len(a), len(b)) and a[start] == b[start]:
        start += 1
    rest_a, rest_b = a[start:], b[start:]
    swapped = rest_a[:2] == rest_b[1::-1] and rest_a[2:] == rest_b[2:]
    return swapped or rest_a[1:] == rest_b[1:] or rest_a[1:] == rest_b or rest_a == rest_b[1:]
