"""From annotated phrases to a compact logistic regression.

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
from services.grounding.features import FactorFeatures, SymbolSet
from services.grounding.hdcg import RuleFeatures
from services.grounding.possession import spelled_out
from services.grounding.tree import Phrase

LEXICAL_PENALTY = 10.0
"""How much more a weight of a particular word costs than one of a kind of word: what can be said
of all words of a kind is not to be learned by heart."""


@dataclass(frozen=True)
class Labelled:
    """One phrase with gold symbols: what its factors are conditioned on, and which are true."""

    phrase: Phrase
    children: SymbolSet
    """Union of the symbols of its child phrases."""
    true: SymbolSet


def labelled_phrases(example: Example) -> list[Labelled]:
    """The phrases of an example with their symbols."""
    return _labelled(example.tree, example.symbols)


def labelled_rules(example: Example, rules: RuleFeatures) -> list[Labelled]:
    """The phrases of an example with the rules that are true there: named there or below."""
    # Trees of corpora keep their shape: no example has a verb of containing.
    phrases = list(example.tree.preorder())
    own = {id(p): rules.project(s) for p, s in zip(phrases, example.symbols, strict=True)}
    below = [frozenset[int]().union(*(own[id(q)] for q in p.preorder())) for p in phrases]
    return _labelled(example.tree, below)


def _labelled(tree: Phrase, symbols: Sequence[SymbolSet]) -> list[Labelled]:
    phrases = list(spelled_out(tree).preorder())
    gold = {id(phrase): true for phrase, true in zip(phrases, symbols, strict=True)}
    return [
        Labelled(p, frozenset[int]().union(*(gold[id(c)] for c in p.phrases)), gold[id(p)])
        for p in phrases
    ]


Row = tuple[bool, tuple[int, ...]]
"""Label and active weights of factors that are alike."""


@dataclass(frozen=True)
class Situation:
    """The features of the factors of one phrase."""

    language: tuple[int, ...]
    """Rows of the language features."""
    matches: NDArray[np.bool_]
    """Symbols x match features."""
    truth: NDArray[np.bool_]
    """Which symbols are true (N,)."""


@dataclass(frozen=True)
class Problem:
    """A merged logistic regression; see `fit`."""

    features: FactorFeatures
    language: dict[str, int]
    columns: NDArray[np.int64]
    """Flat positions in [W | V] of the weights that are learned."""
    costs: NDArray[np.float64]
    """Relative penalty of each of them."""
    design: csr_array
    """Merged rows x learned weights, binary."""
    signs: NDArray[np.float64]
    """+1 for true and -1 for false (rows,)."""
    counts: NDArray[np.float64]
    """How many factors of each example each row stands for (examples, rows)."""

    def weights(self, values: NDArray[np.float64]) -> Weights:
        """Puts learned values back into the matrices that inference uses."""
        attributes = len(self.features.attributes)
        full = np.zeros(len(self.language) * (attributes + len(self.features.match_names)))
        full[self.columns] = values
        matrix = full.reshape(len(self.language), -1)
        return Weights(self.language, matrix[:, :attributes], matrix[:, attributes:])


def build_problem(examples: Sequence[Sequence[Labelled]], space: FactorFeatures) -> Problem:
    """Builds the regression of all factors over a space of symbols.

    Args:
        examples: the phrases of each example.
        space: the symbols and their features.
    """
    language: dict[str, int] = {}
    situations = [[_situation(one, space, language) for one in phrases] for phrases in examples]
    supported = _supported([one for group in situations for one in group], language, space)
    rows: dict[Row, int] = {}
    found = [[_merged(one, supported, space, rows) for one in group] for group in situations]
    counts = np.zeros((len(examples), len(rows)))
    for example, group in enumerate(found):
        for numbers, amounts in group:
            np.add.at(counts[example], numbers, amounts)
    return _assemble(list(rows), counts, language, space)


def _situation(one: Labelled, space: FactorFeatures, language: dict[str, int]) -> Situation:
    column = {name: at for at, name in enumerate(space.match_names)}
    matches = np.zeros((len(space.attributes_of), len(column)), dtype=np.bool_)
    for feature, at in space.matches(one.phrase, one.children):
        matches[at, column[feature]] = True
    truth = np.zeros(len(matches), dtype=np.bool_)
    truth[list(one.true)] = True
    names = space.language(one.phrase, one.children)
    rows = tuple(language.setdefault(name, len(language)) for name in names)
    return Situation(rows, matches, truth)


def _supported(
    situations: Sequence[Situation], language: dict[str, int], space: FactorFeatures
) -> NDArray[np.bool_]:
    """Which W[l, a] are learned: symbol kinds always, names with words seen with a true symbol.

    Names that were never true with a word carry no positive evidence, and names under features
    that are not about words would only learn how often the corpus mentions each class; leaving
    them out also lets most negative rows merge.
    """
    supported = np.zeros((len(language), len(space.attributes)), dtype=np.bool_)
    lexical = {row for name, row in language.items() if features.is_lexical(name)}
    for situation in situations:
        rows = [row for row in situation.language if row in lexical]
        for attribute in space.attributes_of[situation.truth].ravel():
            supported[rows, attribute] = True
    supported[:, np.unique(space.attributes_of[:, 0])] = True
    supported[:, -1] = False
    return supported


def _merged(
    situation: Situation,
    supported: NDArray[np.bool_],
    space: FactorFeatures,
    rows: dict[Row, int],
) -> tuple[list[int], NDArray[np.int64]]:
    """Numbers of the rows that the factors of a phrase are, new ones added, and how many are."""
    learned: NDArray[np.bool_] = np.logical_or.reduce(supported[list(situation.language)], axis=0)
    pad = len(space.attributes) - 1
    attributes = np.where(learned.take(space.attributes_of), space.attributes_of, pad)
    _, firsts, counts = np.unique(
        _packed(situation, attributes), return_index=True, return_counts=True
    )
    numbers: list[int] = []
    for at in firsts.tolist():
        columns = _columns(situation.language, attributes[at], situation.matches[at], supported)
        row = (bool(situation.truth[at]), columns)
        numbers.append(rows.setdefault(row, len(rows)))
    return numbers, counts


def _packed(situation: Situation, attributes: NDArray[np.int64]) -> NDArray[np.int64]:
    """One number for each symbol, equal where features and truth are (N,)."""
    bits = 1 << np.arange(situation.matches.shape[1], dtype=np.int64)
    packed: NDArray[np.int64] = situation.matches.astype(np.int64) @ bits * 2 + situation.truth
    for slot in range(attributes.shape[1]):
        # Renumbered in every slot, so that the product of all radices stays within 64 bits.
        packed = np.unique(packed, return_inverse=True)[1]
        packed = packed * (attributes.max() + 1) + attributes[:, slot]
    return packed


def _columns(
    language: tuple[int, ...],
    attributes: NDArray[np.int64],
    matches: NDArray[np.bool_],
    supported: NDArray[np.bool_],
) -> tuple[int, ...]:
    """Flat positions in the joined matrix [W | V] of a row's active features."""
    width = supported.shape[1] + len(matches)
    hits = (supported.shape[1] + np.flatnonzero(matches)).tolist()
    return tuple(
        row * width + column
        for row in language
        for column in [*(a for a in attributes.tolist() if supported[row, a]), *hits]
    )


def _assemble(
    rows: Sequence[Row],
    counts: NDArray[np.float64],
    language: dict[str, int],
    space: FactorFeatures,
) -> Problem:
    flat = np.fromiter((c for _, columns in rows for c in columns), dtype=np.int64)
    lengths = np.array([len(columns) for _, columns in rows])
    columns, positions = np.unique(flat, return_inverse=True)
    pointers = np.concatenate([[0], np.cumsum(lengths)])
    shape = (len(rows), len(columns))
    design = csr_array((np.ones(len(flat)), positions, pointers), shape=shape)
    signs = np.array([1.0 if true else -1.0 for true, _ in rows])
    costs = _costs(columns, language, space)
    return Problem(space, language, columns, costs, design, signs, counts)


def _costs(
    columns: NDArray[np.int64], language: dict[str, int], space: FactorFeatures
) -> NDArray[np.float64]:
    width = len(space.attributes) + len(space.match_names)
    lexical = np.array([features.is_lexical(name) for name in language])
    return np.where(lexical[columns // width], LEXICAL_PENALTY, 1.0)
