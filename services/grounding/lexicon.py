"""Words, their parts of speech and the senses a robot's symbol space gives them."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from itertools import islice, product
from pathlib import Path

from robots.symbols import SymbolSpace
from services.grounding.entry import (
    FOREIGN_LOG_PROBABILITY,
    KNOWN_LOG_PROBABILITY,
    MISSPELT_LOG_PROBABILITY,
    Entry,
    Sense,
    printed,
)
from services.grounding.errors import GroundingError
from services.grounding.morphology import as_verb, inflected, unknown_entries
from services.grounding.spelling import Spelling
from services.grounding.text import Token, split_clitic

DATA = Path(__file__).parent / "data"
LEXICON_FILES = (DATA / "english.lexicon", DATA / "nouns.lexicon")

MAX_SPELLINGS = 8
"""Ways to spell a run of words that are looked up."""
FILLER, KEPT = "FILLER", "KEEP"
"""Tags of words dropped before parsing, and of longer expressions in which they are not."""
OWN = ":own"
"""End of the tag of an entry that only robots with one of its senses have."""
_SENSE_TAGS = ("NN", "VB", "RB", "JJS", "IN")
"""Tags that mean nothing to a robot which has none of their senses."""
_FREE_TAGS = (
    *("RB:not", "RB:neg", "RB:deg", "RB:there", "RB:as", "RB:can"),
    *("IN:of", "IN:bare", "IN:sub", "IN:ger"),
)
"""Tags that mean something to the grammar alone, so that they need no sense."""
_SENSE_KINDS = ("class", "relation", "action", "mode", "degree")


@dataclass
class Lexicon:
    """All entries of one robot, indexed by their first word."""

    symbols: SymbolSpace
    entries: tuple[Entry, ...]
    """As written in the files, without the inflected forms."""
    _by_words: dict[tuple[str, ...], list[Entry]] = field(
        default_factory=dict[tuple[str, ...], list[Entry]]
    )
    _longest: dict[str, int] = field(default_factory=dict[str, int])
    """Most words of an entry that begins with this word."""
    _senses: dict[tuple[str, str], tuple[Sense, ...]] = field(
        default_factory=dict[tuple[str, str], tuple[Sense, ...]]
    )
    _spelling: Spelling = field(init=False)

    def __post_init__(self) -> None:
        written = {(entry.words, entry.tag) for entry in self.entries}
        forms = [form for entry in self.entries for form in inflected(entry)]
        for entry in (*self.entries, *(f for f in forms if (f.words, f.tag) not in written)):
            self._by_words.setdefault(entry.words, []).append(entry)
            first = entry.words[0]
            self._longest[first] = max(self._longest.get(first, 0), len(entry.words))
        for entry in (entry for entry in self.entries if entry.known):
            key = (printed(entry.tag), entry.text)
            both = (*self._senses.get(key, ()), *entry.senses)
            self._senses[key] = tuple(dict.fromkeys(both))
        self._spelling = Spelling.of(word for words in self._by_words for word in words)

    @classmethod
    def load(cls, symbols: SymbolSpace, paths: Iterable[Path] = LEXICON_FILES) -> "Lexicon":
        """Reads lexicon files and marks what the symbol space gives no meaning.

        Raises:
            GroundingError: a line is malformed (file, line, what is allowed).
        """
        return _loaded(symbols, tuple(paths))

    def senses(self, tag: str, text: str) -> tuple[Sense, ...] | None:
        """Senses of a tree leaf; None for a word that means nothing to the robot."""
        return self._senses.get((tag, text))

    def content_words(self) -> tuple[Entry, ...]:
        """The entries that denote something."""
        return tuple(entry for entry in self.entries if entry.senses)

    def known(self, tag: str, text: str) -> bool:
        """Whether a tree leaf means something to the robot or to the grammar."""
        return (tag, text) in self._senses

    def strip_fillers(self, tokens: Sequence[Token]) -> tuple[Token, ...]:
        """Drops politeness and hesitation, longest match first."""
        kept: list[Token] = []
        at = 0
        while at < len(tokens):
            window = tuple(token.text for token in tokens[at : at + self._longest_at(tokens, at)])
            # A filler inside a longer expression is none: "as fast as [you can]".
            found = ((n, e.tag == FILLER) for n, e in self._entries(window))
            length, filler = max(found, default=(1, False))
            if not filler:
                kept += tokens[at : at + length]
            at += length
        return tuple(kept)

    def _longest_at(self, tokens: Sequence[Token], at: int) -> int:
        return self._longest.get(tokens[at].text, 1)

    def lattice(self, tokens: Sequence[Token]) -> list[tuple[int, int, Entry]]:
        """Every (start, end, entry) that may stand for tokens[start:end]."""
        spans: list[tuple[int, int, Entry]] = []
        spelt = [self._spelling.of_word(token.text) for token in tokens]
        for at, token in enumerate(tokens):
            found = [(at, at + n, e) for n, e in self._spelt_entries(tokens, spelt, at)]
            single = [entry for _, end, entry in found if end == at + 1]
            if not single:
                found += [(at, at + 1, entry) for entry in unknown_entries(token.text)]
            elif all(entry.tag == "NN" and not entry.known for entry in single):
                found.append((at, at + 1, as_verb(token.text)))
            spans += [span for span in found if span[2].tag not in (FILLER, KEPT)]
        return spans

    def _spelt_entries(
        self, tokens: Sequence[Token], spelt: Sequence[tuple[str, ...]], at: int
    ) -> list[tuple[int, Entry]]:
        """Entries that begin at one token, in the nearest known spellings of all tokens."""
        found: list[tuple[int, Entry]] = []
        for first in spelt[at]:
            window = spelt[at : at + self._longest.get(first, 1)]
            # A misspelt word has a few spellings at most, and few words are misspelt.
            for words in islice(product((first,), *window[1:]), MAX_SPELLINGS):
                found += [
                    (
                        n,
                        entry
                        if _is_written(entry, tokens[at : at + n], words)
                        else _misspelt(entry),
                    )
                    for n, entry in self._entries(words)
                ]
        return list(dict.fromkeys(found))

    def _entries(self, words: tuple[str, ...]) -> list[tuple[int, Entry]]:
        """(length, entry) of every entry that spells a beginning of these words."""
        return [
            (length, entry)
            for length in range(1, len(words) + 1)
            for entry in self._by_words.get(words[:length], ())
        ]


def _is_written(entry: Entry, tokens: Sequence[Token], words: tuple[str, ...]) -> bool:
    return all(token.text == word for token, word in zip(tokens, words, strict=False))


def _misspelt(entry: Entry) -> Entry:
    return replace(entry, log_probability=MISSPELT_LOG_PROBABILITY)


@cache
def _loaded(symbols: SymbolSpace, paths: tuple[Path, ...]) -> Lexicon:
    """Read once: no lexicon is changed after it was made."""
    found: dict[tuple[str, tuple[str, ...]], Entry] = {}
    for entry in (entry for path in paths for entry in _read(path, symbols)):
        key = (entry.tag, entry.words)
        if key not in found or not found[key].known:
            found[key] = entry
    return Lexicon(symbols, tuple(found.values()))


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
    tag = columns[1].removesuffix(OWN)
    if tag != columns[1] and not kept:
        return []
    known = bool(kept) or _means_itself(tag)
    score = KNOWN_LOG_PROBABILITY if known else FOREIGN_LOG_PROBABILITY
    return [
        Entry(_words(written), tag, kept, score, known, _words(lemma))
        for written, _, lemma in (item.partition("->") for item in columns[0].split(","))
    ]


def _means_itself(tag: str) -> bool:
    """Whether a word of this tag needs no sense to be known."""
    return printed(tag) not in _SENSE_TAGS or tag in _FREE_TAGS


def _words(text: str) -> tuple[str, ...]:
    return tuple(part for word in text.split() for part in split_clitic(word))


def _sense(item: str, where: str, symbols: SymbolSpace) -> Sense | None:
    kind, _, names = item.partition("=")
    if kind not in _SENSE_KINDS or not names:
        raise GroundingError(f"{where}: sense {item!r}; allowed kinds: {', '.join(_SENSE_KINDS)}")
    allowed = constituents(symbols)[kind]
    return next(
        (Sense(kind, name) for name in names.replace("_", " ").split("/") if name in allowed), None
    )


def constituents(symbols: SymbolSpace) -> dict[str, tuple[str, ...]]:
    """Names of every kind that a sense or a symbol may use."""
    return {
        "class": symbols.object_classes + symbols.locations,
        "relation": symbols.relations,
        "action": symbols.actions,
        "mode": symbols.modes,
        "degree": ("comparative",),
    }
