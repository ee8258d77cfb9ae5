"""Inflected forms of the words in the lexicon, and guesses about words that are not in it."""

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import replace

from services.grounding.entry import KNOWN_LOG_PROBABILITY, UNKNOWN_LOG_PROBABILITY, Entry, printed

_VOWELS = "aeiou"
_NUMERAL = re.compile(r"\d+(?:st|nd|rd|th)?")
_ANY = {"NN:unk": 0.6, "JJ:unk": 0.2, "VB:unk": 0.2}
_BY_SUFFIX: tuple[tuple[str, Mapping[str, float]], ...] = (
    ("ly", {"RB:unk": 0.7, "JJ:unk": 0.2, "NN:unk": 0.1}),
    ("ing", {"VB:unk": 0.4, "NN:unk": 0.4, "JJ:unk": 0.2}),
    ("ed", {"JJ:unk": 0.5, "VBN": 0.2, "VBD": 0.1, "NN:unk": 0.1, "VB:unk": 0.1}),
    ("est", {"JJ:unk": 0.6, "NN:unk": 0.4}),
    ("ous", {"JJ:unk": 0.8, "NN:unk": 0.2}),
    ("ful", {"JJ:unk": 0.8, "NN:unk": 0.2}),
    ("ish", {"JJ:unk": 0.6, "NN:unk": 0.3, "VB:unk": 0.1}),
    ("tion", {"NN:unk": 1.0}),
    ("ness", {"NN:unk": 1.0}),
)
"""Tag probabilities of an unknown word by its ending; the first that fits counts."""
_MIN_STEM = 3
"""Letters before a suffix for it to be one."""


def inflected(entry: Entry) -> Iterator[Entry]:
    """The plural of a noun, the -ing form of a verb; other words have no forms of their own."""
    tag = printed(entry.tag)
    if tag == "NN" and entry.words[-1].isalpha():
        yield replace(entry, words=(*entry.words[:-1], plural(entry.words[-1])), lemma=entry.words)
    elif tag == "VB" and entry.words[0].isalpha():
        yield replace(entry, words=(gerund(entry.words[0]), *entry.words[1:]), lemma=entry.words)


def plural(noun: str) -> str:
    """The regular plural: boxes, batteries, cones."""
    if noun.endswith(("s", "x", "z", "ch", "sh")):
        return noun + "es"
    if noun.endswith("y") and noun[-2:-1] not in _VOWELS:
        return noun[:-1] + "ies"
    return noun + "s"


def gerund(verb: str) -> str:
    """The regular -ing form: moving, getting, going."""
    if verb.endswith("e") and not verb.endswith(("ee", "oe", "ye")) and len(verb) > 2:
        return verb[:-1] + "ing"
    vowels = sum(letter in _VOWELS for letter in verb)
    closed = len(verb) > 2 and verb[-1] not in "aeiouwxy" and verb[-2] in _VOWELS
    if closed and vowels == 1:
        return verb + verb[-1] + "ing"
    return verb + "ing"


def unknown_entries(word: str) -> list[Entry]:
    """Readings of a word that is in no lexicon: a numeral, or tags guessed from its ending."""
    if _NUMERAL.fullmatch(word):
        return [Entry((word,), "CD" if word.isdigit() else "JJ", (), KNOWN_LOG_PROBABILITY)]
    return [
        Entry((word,), tag, (), UNKNOWN_LOG_PROBABILITY + math.log(share), known=False)
        for tag, share in _tags(word).items()
    ]


def as_verb(word: str) -> Entry:
    """The reading as an unknown verb of a word that is known as a noun alone: "water the tree"."""
    score = UNKNOWN_LOG_PROBABILITY + math.log(_ANY["VB:unk"])
    return Entry((word,), "VB:unk", (), score, known=False)


def _tags(word: str) -> Mapping[str, float]:
    fitting = (
        tags
        for suffix, tags in _BY_SUFFIX
        if word.endswith(suffix) and len(word) >= len(suffix) + _MIN_STEM
    )
    return next(fitting, _ANY)
