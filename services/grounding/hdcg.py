"""Hierarchical DCG: a first pass over rules prunes the symbols of the second.

A rule is one constituent on its own (a class, relation, action, mode or degree) and is true at a
phrase if a symbol that is true there or below it names that constituent.  Its labels are so the
projection of the ordinary ones, and no second annotation is needed.  The second pass is the
ordinary DCG over the symbols whose constituents are all true (paper, sec:nlu; Chung et al. 2015):

    p(Γ | Λ) = sum over rule sets r of p(r | Λ) p(Γ | Λ, r)
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from robots.symbols import SymbolSpace
from services.grounding.dcg import CorrespondenceGraph, Distribution, Weights
from services.grounding.features import Hit, SymbolFeatures, SymbolSet, language, meanings
from services.grounding.lexicon import Lexicon
from services.grounding.symbols import ROBOT, SymbolTable
from services.grounding.tree import Phrase

RULE_KINDS = ("class", "relation", "action", "mode", "degree")
RULE_SETS = 3
"""Rule sets that the second pass is run for."""
SAFE_MARGINAL = 0.02
"""A rule of at least this probability stays in every rule set."""
RULE_MATCHES = ("child", "own", "robot")


@dataclass(frozen=True)
class RuleFeatures:
    """The features of the factors over rules: one constituent a symbol."""

    table: SymbolTable
    lexicon: Lexicon

    @cached_property
    def rules(self) -> tuple[tuple[str, str], ...]:
        """(kind, name) of every rule in index order."""
        return tuple((kind, name) for kind in RULE_KINDS for name in self.table.names[kind])

    @cached_property
    def index(self) -> dict[tuple[str, str], int]:
        """Index of every rule."""
        return {rule: at for at, rule in enumerate(self.rules)}

    @property
    def match_names(self) -> tuple[str, ...]:
        """See `FactorFeatures`."""
        return RULE_MATCHES

    @property
    def attributes(self) -> tuple[str, ...]:
        """See `FactorFeatures`."""
        return (*RULE_KINDS, *(f"{kind}={name}" for kind, name in self.rules), "")

    @property
    def attributes_of(self) -> NDArray[np.int64]:
        """See `FactorFeatures`; (N, 2), as a rule has a kind and a name."""
        return self._attributes_of

    @cached_property
    def _attributes_of(self) -> NDArray[np.int64]:
        kinds = [RULE_KINDS.index(kind) for kind, _ in self.rules]
        return np.column_stack([kinds, len(RULE_KINDS) + np.arange(len(self.rules))])

    @cached_property
    def rules_of(self) -> tuple[SymbolSet, ...]:
        """The rules that each symbol of the robot names."""
        return tuple(
            frozenset(self.index[rule] for rule in _rules(s.kind, s.head, s.arguments))
            for s in self.table.symbols
        )

    def project(self, symbols: Iterable[int]) -> SymbolSet:
        """The rules that any of the symbols names."""
        return frozenset[int]().union(*(self.rules_of[at] for at in symbols))

    def language(self, phrase: Phrase, children: SymbolSet) -> tuple[str, ...]:
        """See `FactorFeatures`."""
        kinds = sorted({self.rules[at][0] for at in children})
        return language(phrase, self.lexicon, "+".join(kinds))

    def matches(self, phrase: Phrase, children: SymbolSet) -> Iterator[Hit]:
        """See `FactorFeatures`."""
        own = sorted({self.index[meaning] for meaning in meanings(self.lexicon, phrase)})
        if children:
            yield "child", np.array(sorted(children))
        if own:
            yield "own", np.array(own)
        if ("class", ROBOT) in self.index:
            yield "robot", np.array([self.index["class", ROBOT]])


def _rules(kind: str, head: str, arguments: tuple[str, ...]) -> Iterator[tuple[str, str]]:
    yield ("relation" if kind in ("region", "fact") else kind, head)
    yield from (("class", name) for name in arguments)


@dataclass
class HierarchicalGraph:
    """Inference in two passes with the same answer as one, from far fewer symbols."""

    features: SymbolFeatures
    weights: Weights
    rule_weights: Weights
    scored: int = 0
    """Factors evaluated so far in both passes."""
    _second: dict[SymbolSet, CorrespondenceGraph] = field(
        default_factory=dict[SymbolSet, CorrespondenceGraph]
    )

    @cached_property
    def _rule_features(self) -> RuleFeatures:
        return RuleFeatures(self.features.table, self.features.lexicon)

    @cached_property
    def _first(self) -> CorrespondenceGraph:
        return CorrespondenceGraph(self._rule_features, self.rule_weights)

    def forget(self) -> None:
        """Drops what was kept for phrases that several trees of one sentence share."""
        self._first.forget()
        self._second.clear()

    def infer(self, phrase: Phrase) -> Distribution:
        """Distribution over the sets of symbols that are true at this phrase."""
        found: Distribution = {}
        for rules, share in self.rule_sets(phrase).items():
            for symbols, probability in self._ground(phrase, rules).items():
                found[symbols] = found.get(symbols, 0.0) + share * probability
        return dict(sorted(found.items(), key=lambda item: (-item[1], sorted(item[0]))))

    def rule_sets(self, phrase: Phrase) -> Distribution:
        """The best rule sets, each widened by every rule that is not improbable."""
        before = self._first.scored
        safe = frozenset(np.flatnonzero(self._first.marginals(phrase) > SAFE_MARGINAL).tolist())
        kept = list(self._first.infer(phrase).items())[:RULE_SETS]
        self.scored += self._first.scored - before
        total = sum(probability for _, probability in kept)
        widened: Distribution = {}
        for rules, probability in kept:
            widened[rules | safe] = widened.get(rules | safe, 0.0) + probability / total
        return widened

    def _ground(self, phrase: Phrase, rules: SymbolSet) -> Distribution:
        if rules not in self._second:
            self._second[rules] = self._pruned(rules)
        graph = self._second[rules]
        before = graph.scored
        full, part = self.features.table, graph.features
        assert isinstance(part, SymbolFeatures)
        found = {
            frozenset(full.index[part.table.symbols[at]] for at in symbols): probability
            for symbols, probability in graph.infer(phrase).items()
        }
        self.scored += graph.scored - before
        return found

    def _pruned(self, rules: SymbolSet) -> CorrespondenceGraph:
        """The ordinary graph over the symbols whose constituents are all among the rules."""
        table = SymbolTable(_pruned_space(self._rule_features, rules))
        features = replace(self.features, table=table)
        column = {name: at for at, name in enumerate(self.features.attributes)}
        static = self.weights.static[:, [column[name] for name in table.attributes]]
        return CorrespondenceGraph(features, replace(self.weights, static=static))


def _pruned_space(features: RuleFeatures, rules: SymbolSet) -> SymbolSpace:
    kept = {features.rules[at] for at in rules}
    space = features.table.space

    def of_kind(kind: str, names: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(name for name in names if (kind, name) in kept)

    return SymbolSpace(
        object_classes=of_kind("class", space.object_classes),
        locations=of_kind("class", space.locations),
        relations=of_kind("relation", space.relations),
        actions=of_kind("action", space.actions),
        modes=of_kind("mode", space.modes),
    )
