"""Words, their parts of speech and the senses a robot's symbol space gives them."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from robots.symbols import SymbolSpace
from services.grounding.errors import GroundingError
from services.grounding.text import Token

DATA = Path(__file__).parent / "data"
LEXICON_FILES = (DATA / "english.lexicon", DATA / "nouns.lexicon")

KNOWN_LOG_PROBABILITY = -4.0
MISSPELT_LOG_PROBABILITY = -8.0
UNKNOWN_TAGS = {"NN:unk": math.log(0.6), "JJ:unk": math.log(0.2), "VB:unk": math.log(0.2)}
UNKNOWN_LOG_PROBABILITY = -9.0
MIN_CORRECTED_LETTERS = 5
"""Shorter words have too many neighbours at distance one to be corrected."""

_CONTENT_TAGS = ("NN", "VB", "RB", "JJS", "IN")
_FREE_TAGS = ("RB:not", "RB:deg", "IN:of", "IN:bare")
"""Tags that mean something to the grammar alone, so that they need no sense."""
_SENSE_KINDS = ("class", "relation", "action", "mode", "degree")


@dataclass(frozen=True)
class Sense:
    """What a word may denote: one constituent of the robot's symbol space."""

    kind: str
    """One of class (objects and locations), relation, action, mode, degree."""
    name: str


@dataclass(frozen=True)
class Entry:
    """One reading of one or several written words."""

    words: tuple[str, ...]
    tag: str
    senses: tuple[Sense, ...]
    log_probability: float = KNOWN_LOG_PROBABILITY
    known: bool = True

    @property
    def text(self) -> str:
        """The words joined as in a tree leaf."""
        return "_".join(self.words)

    @property
    def meanings(self) -> tuple[tuple[str, str], ...]:
        """(kind, name) of every sense."""
        return tuple((sense.kind, sense.name) for sense in self.senses)


@dataclass
class Lexicon:
    """All entries of one robot, indexed by their first word."""

    symbols: SymbolSpace
    entries: tuple[Entry, ...]
    _by_first: dict[str, list[Entry]] = field(default_factory=dict[str, list[Entry]])
    _senses: dict[tuple[str, str], tuple[Sense, ...]] = field(
        default_factory=dict[tuple[str, str], tuple[Sense, ...]]
    )

    def __post_init__(self) -> None:
        for entry in self.entries:
            self._by_first.setdefault(entry.words[0], []).append(entry)
            self._senses[(printed(entry.tag), entry.text)] = entry.senses

    @classmethod
    def load(cls, symbols: SymbolSpace, paths: Iterable[Path] = LEXICON_FILES) -> "Lexicon":
        """Reads lexicon files and keeps what the symbol space gives a meaning.

        Raises:
            GroundingError: a line is malformed (file, line, what is allowed).
        """
        return cls(symbols, tuple(entry for path in paths for entry in _read(path, symbols)))

    def senses(self, tag: str, text: str) -> tuple[Sense, ...] | None:
        """Senses of a tree leaf; None for a word that is not in the lexicon."""
        return self._senses.get((tag, text))

    def content_words(self) -> tuple[Entry, ...]:
        """The entries that denote a class, an action or a mode."""
        return tuple(entry for entry in self.entries if entry.senses and entry.tag != "FILLER")

    def known(self, tag: str, text: str) -> bool:
        """Whether a tree leaf is in the lexicon."""
        return (tag, text) in self._senses

    def strip_fillers(self, tokens: Sequence[Token]) -> tuple[Token, ...]:
        """Drops politeness and hesitation, longest match first."""
        kept: list[Token] = []
        at = 0
        while at < len(tokens):
            lengths = [len(e.words) for e in self._matches(tokens, at) if e.tag == "FILLER"]
            if not lengths:
                kept.append(tokens[at])
            at += max(lengths, default=1)
        return tuple(kept)

    def lattice(self, tokens: Sequence[Token]) -> list[tuple[int, int, Entry]]:
        """Every (start, end, entry) that may stand for tokens[start:end]."""
        spans: list[tuple[int, int, Entry]] = []
        for at, token in enumerate(tokens):
            found = [(at, at + len(entry.words), entry) for entry in self._matches(tokens, at)]
            single = any(end == at + 1 for _, end, _ in found)
            inside = any(start < at < end for start, end, _ in spans)
            if not single:
                corrected = [] if inside else self._corrected(token.text)
                found += [(at, at + 1, e) for e in corrected or _unknown(token.text)]
            spans += [span for span in found if span[2].tag != "FILLER"]
        return spans

    def _matches(self, tokens: Sequence[Token], at: int) -> list[Entry]:
        texts = tuple(token.text for token in tokens[at : at + 8])
        found = self._by_first.get(texts[0], ())
        return [entry for entry in found if texts[: len(entry.words)] == entry.words]

    def _corrected(self, word: str) -> list[Entry]:
        """Entries one typing slip away: a letter changed, missing, doubled or swapped."""
        if not MIN_CORRECTED_LETTERS <= len(word) <= 24:
            return []
        return [
            Entry(entry.words, entry.tag, entry.senses, MISSPELT_LOG_PROBABILITY)
            for first, entries in self._by_first.items()
            if len(first) >= MIN_CORRECTED_LETTERS and is_one_slip(word, first)
            for entry in entries
            if len(entry.words) == 1
        ]


def printed(tag: str) -> str:
    """The part of a label that a tree shows."""
    return tag.partition(":")[0]


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


def _unknown(word: str) -> list[Entry]:
    return [
        Entry((word,), tag, (), UNKNOWN_LOG_PROBABILITY + prior, known=False)
        for tag, prior in UNKNOWN_TAGS.items()
    ]


def _read(path: Path, symbols: SymbolSpace) -> list[Entry]:
    entries: list[Entry] = []
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        content = line.partition("#")[0].strip()
        if content:
            entries += _read_line(content, f"{path.name}:{number}", symbols)
    return entries


def _read_line(line: str, where: str, symbols: SymbolSpace) -> list[Entry]:
    columns = [column.strip() for column in line.split("|")]
    if len(columns) != 3 or not columns[0] or not columns[1]:
        raise GroundingError(f"{where}: {line!r}; allowed: words, words | TAG | kind=name ...")
    senses = [_sense(item, where, symbols) for item in columns[2].split()]
    kept = tuple(sense for sense in senses if sense)
    tag = columns[1]
    if columns[2] and not kept and printed(tag) in _CONTENT_TAGS and tag not in _FREE_TAGS:
        return []
    return [Entry(tuple(words.split()), tag, kept) for words in columns[0].split(",")]


def _sense(item: str, where: str, symbols: SymbolSpace) -> Sense | None:
    kind, _, names = item.partition("=")
    if kind not in _SENSE_KINDS or not names:
        raise GroundingError(f"{where}: sense {item!r}; allowed kinds: {', '.join(_SENSE_KINDS)}")
    allowed = constituents(symbols)[kind]
    return next((Sense(kind, name) for name in names.split("/") if name in allowed), None)


def constituents(symbols: SymbolSpace) -> dict[str, tuple[str, ...]]:
    """Names of every kind that a sense or a symbol may use."""
    return {
        "class": symbols.object_classes + symbols.locations,
        "relation": symbols.relations,
        "action": symbols.actions,
        "mode": symbols.modes,
        "degree": ("comparative",),
    }
