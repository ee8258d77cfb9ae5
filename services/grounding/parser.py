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
from services.grounding.text import Token
from services.grounding.tree import Phrase, Word

FRAGMENTS = "FRAG"
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


def parse(tokens: Sequence[Token], lexicon: Lexicon, grammar: Grammar) -> tuple[Parse, ...]:
    """The k best trees of a sentence, best first; none for an empty sentence.

    Probabilities are exact posteriors p(Λ | text) under the weighted grammar, so they sum to one
    less the mass of the trees left out (paper, sec:nlu).
    """
    if not tokens:
        return ()
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
