"""From annotated examples to a compact logistic regression.

Every symbol of the space at every phrase is a row; rows with equal features and label are merged
and counted, which makes some hundred thousand rows a few thousand.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from services.grounding import features
from services.grounding.corpus import Example
from services.grounding.dcg import Weights
from services.grounding.features import MATCHES, SymbolSet
from services.grounding.lexicon import Lexicon
from services.grounding.symbols import KINDS, SymbolTable
from services.grounding.tree import Phrase


@dataclass(frozen=True)
class Situation:
    """One phrase with gold child symbols: what its factors are conditioned on."""

    language: tuple[int, ...]
    """Rows of the language features."""
    matches: NDArray[np.bool_]
    """Symbols x match features."""
    truth: NDArray[np.bool_]
    """Which symbols are true (N,)."""


@dataclass(frozen=True)
class Problem:
    """A merged logistic regression; see `fit`."""

    table: SymbolTable
    language: dict[str, int]
    columns: NDArray[np.int64]
    """Flat positions in [W | V] of the weights that are learned."""
    design: csr_array
    """Merged rows x learned weights, binary."""
    signs: NDArray[np.float64]
    """+1 for true and -1 for false (rows,)."""
    counts: NDArray[np.float64]
    """How many factors each row stands for (rows,)."""

    def weights(self, values: NDArray[np.float64]) -> Weights:
        """Puts learned values back into the matrices that inference uses."""
        attributes = len(self.table.attributes)
        full = np.zeros(len(self.language) * (attributes + len(MATCHES)))
        full[self.columns] = values
        matrix = full.reshape(len(self.language), -1)
        return Weights(self.language, matrix[:, :attributes], matrix[:, attributes:])


def build_problem(examples: Sequence[Example], table: SymbolTable, lexicon: Lexicon) -> Problem:
    """Builds the regression from examples with gold child symbols at every phrase."""
    language: dict[str, int] = {}
    situations = [
        _situation(phrase, children, true, table, lexicon, language)
        for example in examples
        for phrase, children, true in _phrases(example)
    ]
    supported = _supported(situations, language, table)
    rows: dict[tuple[bool, tuple[int, ...]], int] = {}
    for situation in situations:
        _merge(situation, supported, table, rows)
    return _assemble(rows, language, table)


def _phrases(example: Example) -> list[tuple[Phrase, SymbolSet, SymbolSet]]:
    """Every phrase with the union of its children's gold symbols and its own."""
    phrases = list(example.tree.preorder())
    gold = {id(phrase): true for phrase, true in zip(phrases, example.symbols, strict=True)}
    return [
        (phrase, frozenset[int]().union(*(gold[id(c)] for c in phrase.phrases)), gold[id(phrase)])
        for phrase in phrases
    ]


def _situation(
    phrase: Phrase,
    children: SymbolSet,
    true: SymbolSet,
    table: SymbolTable,
    lexicon: Lexicon,
    language: dict[str, int],
) -> Situation:
    names = features.language(phrase, lexicon, features.child_kinds(table, children))
    own = features.of_words(table, lexicon, phrase)
    matches = np.zeros((len(table.symbols), len(MATCHES)), dtype=np.bool_)
    for feature, at in features.matches(table, own, features.of_children(table, children)):
        matches[at, feature] = True
    truth = np.zeros(len(table.symbols), dtype=np.bool_)
    truth[list(true)] = True
    rows = tuple(language.setdefault(name, len(language)) for name in names)
    return Situation(rows, matches, truth)


def _supported(
    situations: Sequence[Situation], language: dict[str, int], table: SymbolTable
) -> NDArray[np.bool_]:
    """Which W[l, a] are learned: symbol kinds always, names with words seen with a true symbol.

    Names that were never true with a word carry no positive evidence, and names under features
    that are not about words would only learn how often the corpus mentions each class; leaving
    them out also lets most negative rows merge.
    """
    supported = np.zeros((len(language), len(table.attributes)), dtype=np.bool_)
    lexical = {row for name, row in language.items() if features.is_lexical(name)}
    for situation in situations:
        rows = [row for row in situation.language if row in lexical]
        for attribute in table.attributes_of[situation.truth].ravel():
            supported[rows, attribute] = True
    kinds = [table.attributes.index(kind) for kind in KINDS if kind in table.attributes]
    supported[:, kinds] = True
    supported[:, -1] = False
    return supported


def _merge(
    situation: Situation,
    supported: NDArray[np.bool_],
    table: SymbolTable,
    rows: dict[tuple[bool, tuple[int, ...]], int],
) -> None:
    learned: NDArray[np.bool_] = np.logical_or.reduce(supported[list(situation.language)], axis=0)
    pad = len(table.attributes) - 1
    useful = learned.take(table.attributes_of)
    attributes = np.where(useful, table.attributes_of, pad)
    packed = _packed(situation, attributes, pad + 1)
    _, firsts, counts = np.unique(packed, return_index=True, return_counts=True)
    for at, count in zip(firsts.tolist(), counts.tolist(), strict=True):
        columns = _columns(situation.language, attributes[at], situation.matches[at], supported)
        row = (bool(situation.truth[at]), columns)
        rows[row] = rows.get(row, 0) + count


def _packed(situation: Situation, attributes: NDArray[np.int64], radix: int) -> NDArray[np.int64]:
    """One number for each symbol, equal where features and truth are (N,)."""
    bits = 1 << np.arange(len(MATCHES), dtype=np.int64)
    packed: NDArray[np.int64] = situation.matches.astype(np.int64) @ bits * 2 + situation.truth
    for slot in range(attributes.shape[1]):
        packed = packed * radix + attributes[:, slot]
    return packed


def _columns(
    language: tuple[int, ...],
    attributes: NDArray[np.int64],
    matches: NDArray[np.bool_],
    supported: NDArray[np.bool_],
) -> tuple[int, ...]:
    """Flat positions in the joined matrix [W | V] of a row's active features."""
    width = supported.shape[1] + len(MATCHES)
    hits = (supported.shape[1] + np.flatnonzero(matches)).tolist()
    return tuple(
        row * width + column
        for row in language
        for column in [*(a for a in attributes.tolist() if supported[row, a]), *hits]
    )


def _assemble(
    rows: dict[tuple[bool, tuple[int, ...]], int], language: dict[str, int], table: SymbolTable
) -> Problem:
    flat = np.fromiter((c for _, columns in rows for c in columns), dtype=np.int64)
    lengths = np.array([len(columns) for _, columns in rows])
    columns, positions = np.unique(flat, return_inverse=True)
    pointers = np.concatenate([[0], np.cumsum(lengths)])
    shape = (len(rows), len(columns))
    design = csr_array((np.ones(len(flat)), positions, pointers), shape=shape)
    signs = np.array([1.0 if true else -1.0 for true, _ in rows])
    counts = np.array(list(rows.values()), dtype=np.float64)
    return Problem(table, language, columns, design, signs, counts)
