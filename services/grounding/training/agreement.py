"""How well the two passes of the HDCG agree with the one of the DCG, and what they save."""

from collections.abc import Iterable
from dataclasses import dataclass

from services.grounding.dcg import CorrespondenceGraph, Distribution
from services.grounding.hdcg import HierarchicalGraph
from services.grounding.model import GroundingModel


@dataclass(frozen=True)
class Agreement:
    """Over a set of sentences; their best parse each."""

    sentences: int
    same_best: float
    """Share of the sentences whose most probable set of symbols is the same."""
    total_variation: float
    """Mean distance of the two distributions, in [0, 1]."""
    dcg_symbols: float
    """Symbols scored by a sentence in one pass, mean."""
    hdcg_symbols: float
    """The same in two passes, both counted."""

    @property
    def pruning_factor(self) -> float:
        """How many times fewer symbols two passes score."""
        return self.dcg_symbols / self.hdcg_symbols


class NotHierarchicalError(ValueError):
    """The robot has no weights for the first pass; wheelchair has."""


def measure_agreement(model: GroundingModel, texts: Iterable[str]) -> Agreement:
    """Grounds every text both ways.

    Raises:
        NotHierarchicalError: the model has no rule weights.
    """
    weights = model.weights
    if weights.rules is None:
        raise NotHierarchicalError("a model without rule weights; the wheelchair's has them")
    one = CorrespondenceGraph(model.features, weights.factors)
    two = HierarchicalGraph(model.features, weights.factors, weights.rules)
    trees = [parses[0].tree for parses in map(model.parses, texts) if parses]
    same, distance = 0, 0.0
    for tree in trees:
        one.forget()
        two.forget()
        full, pruned = one.infer(tree), two.infer(tree)
        same += _best(full) == _best(pruned)
        distance += _distance(full, pruned)
    count = max(len(trees), 1)
    return Agreement(
        len(trees), same / count, distance / count, one.scored / count, two.scored / count
    )


def _best(found: Distribution) -> frozenset[int]:
    return max(found, key=lambda symbols: found[symbols])


def _distance(first: Distribution, second: Distribution) -> float:
    """Total variation; what either left out counts as one more outcome."""
    keys = first.keys() | second.keys()
    lost = abs(sum(first.values()) - sum(second.values()))
    gaps = sum(abs(first.get(key, 0.0) - second.get(key, 0.0)) for key in keys)
    return 0.5 * (gaps + lost)
