"""Text to a distribution over phrase trees; any text gives an answer."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import count

from services.grounding.chart import (
    Chart,
    Vertex,
    build_tree,
    derivation,
    fill_chart,
    fragment_cover,
    root_vertex,
)
from services.grounding.grammar import ROOT, Grammar
from services.grounding.lexicon import Lexicon
from services.grounding.text import MAX_WORDS, Token
from services.grounding.tree import Phrase, Word

FRAGMENTS = "FRAG"
LOOSE = "X"
"""Tag of words behind the last piece of a text that is far too long."""
MAX_PIECES = 3
"""Pieces of `MAX_WORDS` words that are parsed of a long text; the words behind them stay loose."""
BEST_TREES = 5
MAX_DERIVATIONS = 20
"""Derivations looked at for `BEST_TREES` different trees; flat trees have several each."""


@dataclass(frozen=True)
class Parse:
    """One tree with its posterior probability."""

    tree: Phrase
    probability: float
    partial: bool = False
    """True if the grammar does not cover the text and the tree only collects fragments."""

    @property
    def unattached(self) -> tuple[str, ...]:
        """The words that belong to no phrase, in the order of the text."""
        return tuple(word.surface for word in self.tree.words) if self.partial else ()


def parse(tokens: Sequence[Token], lexicon: Lexicon, grammar: Grammar) -> tuple[Parse, ...]:
    """The k best trees of a sentence, best first; none for an empty sentence.

    Probabilities are exact posteriors p(Λ | text) under the weighted grammar, so they sum to one
    less the mass of the trees left out (paper, sec:nlu).
    """
    if not tokens:
        return ()
    if len(tokens) > MAX_WORDS:
        return (_in_pieces(tokens, lexicon, grammar),)
    chart = fill_chart(lexicon.lattice(tokens), len(tokens), grammar)
    root = root_vertex(chart)
    return _best_trees(root) if root else (_fragments(chart),)


def _best_trees(root: Vertex) -> tuple[Parse, ...]:
    probabilities: dict[Phrase, float] = {}
    for rank in count():
        found = derivation(root, rank)
        if found is None or rank >= MAX_DERIVATIONS:
            break
        (node,) = build_tree(root, found)
        assert isinstance(node, Phrase)
        tree = _without_root(node)
        probability = math.exp(found.score - root.inside)
        if tree in probabilities or len(probabilities) < BEST_TREES:
            probabilities[tree] = probabilities.get(tree, 0.0) + probability
    ranked = sorted(probabilities.items(), key=lambda item: -item[1])
    return tuple(Parse(tree, probability) for tree, probability in ranked)


def _without_root(node: Phrase) -> Phrase:
    return node.phrases[0] if node.label == ROOT else node


def _fragments(chart: Chart) -> Parse:
    vertices, _ = fragment_cover(chart)
    nodes: list[Phrase | Word] = []
    for vertex in vertices:
        found = derivation(vertex, 0)
        assert found is not None
        nodes += build_tree(vertex, found)
    return Parse(Phrase(FRAGMENTS, tuple(nodes)), 1.0, partial=True)


def _in_pieces(tokens: Sequence[Token], lexicon: Lexicon, grammar: Grammar) -> Parse:
    """The best trees of the pieces side by side: a chart over all words would take too long."""
    starts = range(0, min(len(tokens), MAX_PIECES * MAX_WORDS), MAX_WORDS)
    trees = [parse(tokens[at : at + MAX_WORDS], lexicon, grammar)[0] for at in starts]
    nodes: list[Phrase | Word] = []
    for one in trees:
        nodes += one.tree.children if one.partial else (one.tree,)
    nodes += [Word(LOOSE, token.text) for token in tokens[starts[-1] + MAX_WORDS :]]
    return Parse(Phrase(FRAGMENTS, tuple(nodes)), 1.0, partial=True)
