"""Annotated instructions: a readable text format and its checker.

    go to the hydrant                                   the sentence, not indented
        (VP (VB go) (PP (TO to) (NP ...)))              its phrase tree, indented
        VP go to the hydrant: navigate(hydrant)         one line a phrase, parents first
        PP to the hydrant: hydrant
        NP the hydrant: hydrant

Blank lines and lines that start with # are skipped.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from services.grounding.errors import GroundingError
from services.grounding.features import SymbolSet
from services.grounding.symbols import SymbolTable
from services.grounding.tree import Phrase, parse_bracket

CORPORA = Path(__file__).parent / "corpora"


@dataclass(frozen=True)
class Example:
    """One fully annotated sentence."""

    text: str
    tree: Phrase
    symbols: tuple[SymbolSet, ...]
    """True symbols of every phrase, in pre-order of the tree."""


@dataclass(frozen=True)
class HeldOut:
    """One sentence with the symbols of its root alone, for tests."""

    text: str
    symbols: SymbolSet


Line = tuple[int, str]


def read_corpus(path: Path, table: SymbolTable) -> tuple[Example, ...]:
    """Reads all examples of a corpus file.

    Raises:
        GroundingError: file, line, what is wrong and what is allowed.
    """
    groups: list[list[Line]] = []
    for number, line in _content_lines(path):
        if not line[0].isspace():
            groups.append([])
        elif not groups:
            raise GroundingError(f"{path.name}:{number}: a file starts with a sentence in column 1")
        groups[-1].append((number, line.strip()))
    return tuple(_example(group, path.name, table) for group in groups)


def read_held_out(path: Path, table: SymbolTable) -> tuple[HeldOut, ...]:
    """Reads `sentence | symbol, symbol` lines.

    Raises:
        GroundingError: file, line, what is wrong and what is allowed.
    """
    found: list[HeldOut] = []
    for number, line in _content_lines(path):
        text, bar, symbols = line.partition("|")
        where = f"{path.name}:{number}"
        if not bar:
            raise GroundingError(f"{where}: {line!r}; allowed: sentence | symbol, symbol")
        found.append(HeldOut(text.strip(), _symbols(symbols, where, table)))
    return tuple(found)


def _content_lines(path: Path) -> list[Line]:
    lines = enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
    return [(n, line) for n, line in lines if line.strip() and not line.startswith("#")]


def _example(group: Sequence[Line], file: str, table: SymbolTable) -> Example:
    (number, text), *rest = group
    if not rest:
        raise GroundingError(f"{file}:{number}: {text!r} has no tree below it; allowed: (VP ...)")
    (tree_number, bracket), *labelled = rest
    try:
        tree = parse_bracket(bracket)
    except GroundingError as error:
        raise GroundingError(f"{file}:{tree_number}: {error}") from error
    phrases = tuple(tree.preorder())
    if len(labelled) != len(phrases):
        raise GroundingError(
            f"{file}:{tree_number}: {len(labelled)} annotated phrases below a tree that has "
            f"{len(phrases)}; allowed: one line each, parents first: "
            + "; ".join(f"{phrase.label} {phrase.surface}" for phrase in phrases)
        )
    pairs = zip(labelled, phrases, strict=True)
    return Example(text, tree, tuple(_annotated(line, p, file, table) for line, p in pairs))


def _annotated(line: Line, phrase: Phrase, file: str, table: SymbolTable) -> SymbolSet:
    number, content = line
    head, _, symbols = content.partition(":")
    expected = f"{phrase.label} {phrase.surface}"
    if head.strip() != expected:
        raise GroundingError(f"{file}:{number}: {head.strip()!r}; allowed here: {expected!r}")
    return _symbols(symbols, f"{file}:{number}", table)


def _symbols(text: str, where: str, table: SymbolTable) -> SymbolSet:
    # A comma separates symbols only outside brackets.
    items = text.replace("),", ")\n").split("\n")
    flat = [s for item in items for s in (item.split(",") if "(" not in item else _split(item))]
    try:
        return frozenset(table.parse(item) for item in flat if item.strip())
    except GroundingError as error:
        raise GroundingError(f"{where}: {error}") from error


def _split(item: str) -> list[str]:
    """Splits `hydrant, cone, back(hydrant, cone)` before the first bracket only."""
    before, bracket, after = item.partition("(")
    *plain, head = before.split(",")
    return [*plain, head + bracket + after]
