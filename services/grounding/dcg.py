"""Distributed correspondence graph: log-linear factors and exact K-best inference over a tree.

Each correspondence variable φ_ij says whether symbol γ_j is true at phrase λ_i.  Given the symbols
of the child phrases, the φ of one phrase are independent (paper, sec:nlu), so the best set is
{logit > 0} and the next best ones follow by flipping the variables of smallest |logit|: exact,
where a beam over symbols would be approximate.
"""

import heapq
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from services.grounding.features import FactorFeatures, SymbolSet
from services.grounding.tree import Phrase

KEPT_SETS = 5
MAX_COMBINATIONS = 25
NEGATIONS = frozenset({"not", "no", "never", "cannot"})
NEGLIGIBLE = 1e-4
"""Combinations of child sets below this probability go to the lost mass."""

Distribution = dict[SymbolSet, float]
"""Probability of each kept set of true symbols; sums to one less the lost mass."""


@dataclass(frozen=True)
class Weights:
    """Learned weights of the factors."""

    language: dict[str, int]
    """Row of each language feature."""
    static: NDArray[np.float64]
    """W: language features x symbol attributes, the pad attribute's column zero."""
    match: NDArray[np.float64]
    """V: language features x match features."""


@dataclass
class CorrespondenceGraph:
    """Scores phrases against one space of symbols."""

    features: FactorFeatures
    weights: Weights
    """Its static columns are the attributes of `features`."""
    scored: int = 0
    """Factors evaluated so far: symbols, summed over phrases and choices of child sets."""
    _cache: dict[Phrase, Distribution] = field(default_factory=dict[Phrase, Distribution])

    def infer(self, phrase: Phrase) -> Distribution:
        """Distribution over the sets of symbols that are true at this phrase."""
        if is_denied(phrase):
            return {frozenset(): 1.0}
        if phrase not in self._cache:
            children = [self.infer(child) for child in phrase.phrases]
            self._cache[phrase] = self._combine(phrase, children)
        return self._cache[phrase]

    def forget(self) -> None:
        """Drops what was kept for phrases that several trees of one sentence share."""
        self._cache.clear()

    def logits(self, phrase: Phrase, children: SymbolSet) -> NDArray[np.float64]:
        """Log odds of every symbol at a phrase, given the union of its children's symbols (N,)."""
        names = self.features.language(phrase, children)
        rows = [self.weights.language[name] for name in names if name in self.weights.language]
        scores = self.weights.static[rows].sum(axis=0)[self.features.attributes_of].sum(axis=1)
        match = dict(
            zip(self.features.match_names, self.weights.match[rows].sum(axis=0), strict=True)
        )
        for feature, symbols in self.features.matches(phrase, children):
            scores[symbols] += match[feature]
        self.scored += len(scores)
        return scores

    def marginals(self, phrase: Phrase) -> NDArray[np.float64]:
        """Probability of every symbol at a phrase, over the kept sets of its children (N,)."""
        total = np.zeros(len(self.features.attributes_of))
        for probability, union in self._unions([self.infer(child) for child in phrase.phrases]):
            total += probability * np.exp(-np.logaddexp(0.0, -self.logits(phrase, union)))
        return total

    def _combine(self, phrase: Phrase, children: Sequence[Distribution]) -> Distribution:
        found: dict[SymbolSet, float] = {}
        for probability, union in self._unions(children):
            for log_probability, symbols in best_sets(self.logits(phrase, union), KEPT_SETS):
                mass = probability * math.exp(log_probability)
                found[symbols] = found.get(symbols, 0.0) + mass
        ranked = sorted(found.items(), key=lambda item: (-item[1], sorted(item[0])))
        return dict(ranked[:KEPT_SETS])

    @staticmethod
    def _unions(children: Sequence[Distribution]) -> list[tuple[float, SymbolSet]]:
        """Probability of each union of child symbols; combinations that agree are summed."""
        unions: dict[SymbolSet, float] = {}
        for probability, union in combinations(children):
            unions[union] = unions.get(union, 0.0) + probability
        return [(probability, union) for union, probability in unions.items()]


def is_denied(phrase: Phrase) -> bool:
    """Whether a phrase says what is not so, or not to be done, and so denotes nothing."""
    words = (word for word in phrase.words if word.tag in ("VBZ", "RB"))
    negated = any(NEGATIONS & set(word.text.split("_")) for word in words)
    return phrase.label == "NEG" or (phrase.label == "VP" and negated)


def combinations(children: Sequence[Distribution]) -> Iterator[tuple[float, SymbolSet]]:
    """Yields (probability, union of symbols) over one kept set per child, most probable first."""
    combined: list[tuple[float, SymbolSet]] = [(1.0, frozenset())]
    for child in children:
        extended = [
            (mass * probability, union | symbols)
            for mass, union in combined
            for symbols, probability in child.items()
            if mass * probability > NEGLIGIBLE
        ]
        combined = sorted(extended, key=lambda item: -item[0])[:MAX_COMBINATIONS]
    yield from combined


def best_sets(logits: NDArray[np.float64], count: int) -> list[tuple[float, SymbolSet]]:
    """The `count` most probable sets of independent Bernoulli variables, with log probabilities.

    Args:
        logits: log odds of each variable (N,).
        count: how many sets to return.
    """
    magnitude = np.abs(logits)
    best = frozenset(np.flatnonzero(logits > 0.0).tolist())
    top = -float(np.logaddexp(0.0, -magnitude).sum())
    order = np.argpartition(magnitude, min(count, len(logits) - 1))[:count]
    order = order[np.argsort(magnitude[order], kind="stable")]
    costs = magnitude[order].tolist()
    return [
        (top - cost, best ^ frozenset(order[list(flips)].tolist()))
        for cost, flips in _cheapest_subsets(costs, count)
    ]


def _cheapest_subsets(
    costs: Sequence[float], count: int
) -> Iterator[tuple[float, tuple[int, ...]]]:
    """Yields (cost, positions) of the subsets with the smallest sums; `costs` ascend."""
    yield 0.0, ()
    queue: list[tuple[float, tuple[int, ...]]] = [(costs[0], (0,))]
    for _ in range(count - 1):
        if not queue:
            return
        cost, flips = heapq.heappop(queue)
        yield cost, flips
        last = flips[-1]
        if last + 1 < len(costs):
            heapq.heappush(queue, (cost + costs[last + 1], (*flips, last + 1)))
            swapped = cost - costs[last] + costs[last + 1]
            heapq.heappush(queue, (swapped, (*flips[:-1], last + 1)))
