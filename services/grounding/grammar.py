"""The weighted grammar, read from data and binarised for the chart."""

import math
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

from services.grounding.errors import GroundingError
from services.grounding.lexicon import DATA

GRAMMAR_FILE = DATA / "english.grammar"
ROOT = "ROOT"


@dataclass(frozen=True)
class Rule:
    """One binary or unary production."""

    parent: str
    children: tuple[str, ...]
    log_probability: float
    spliced: tuple[bool, ...]
    """Per child: whether its children become the parent's own in the tree."""


BinaryRules = dict[str, dict[str, list[Rule]]]
"""By left child, then by right child."""


@dataclass(frozen=True)
class Rules:
    """Binarised rules, indexed the way the chart asks for them."""

    binary: BinaryRules
    unary: tuple[Rule, ...]
    """Ordered so that a rule stands after those that build its child."""

    @classmethod
    def of(cls, rules: Iterable[Rule], path: Path) -> "Rules":
        """Indexes rules.

        Raises:
            GroundingError: unary rules form a cycle.
        """
        binary: BinaryRules = defaultdict(lambda: defaultdict(list))
        unary: list[Rule] = []
        for rule in rules:
            if len(rule.children) == 2:
                binary[rule.children[0]][rule.children[1]].append(rule)
            else:
                unary.append(rule)
        return cls(binary, _ordered(unary, path))


@dataclass(frozen=True)
class Grammar:
    """The rules, and those of them that can be of use behind the first word."""

    first: Rules
    inner: Rules

    @classmethod
    @cache
    def load(cls, path: Path = GRAMMAR_FILE) -> "Grammar":
        """Reads a grammar file.

        Raises:
            GroundingError: a malformed line, or unary rules that form a cycle.
        """
        binarised = (_binarised(raw) for raw in _normalised(_read(path)))
        rules = list(dict.fromkeys(rule for some in binarised for rule in some))
        initial = _initial_labels(rules)
        inner = [rule for rule in rules if rule.parent not in initial]
        return cls(Rules.of(rules, path), Rules.of(inner, path))

    def rules_at(self, start: int) -> Rules:
        """The rules for phrases that begin at this word."""
        return self.inner if start else self.first


def _initial_labels(rules: Iterable[Rule]) -> set[str]:
    """Labels that complete parses use at the first word alone, such as the root itself."""
    rules = list(rules)
    initial = {ROOT, *(rule.children[0] for rule in rules)}
    initial -= {child for rule in rules for child in rule.children[1:]}
    while True:
        deeper = {r.children[0] for r in rules if r.parent not in initial} & initial - {ROOT}
        if not deeper:
            return initial
        initial -= deeper


def _read(path: Path) -> list[tuple[str, tuple[str, ...], float]]:
    rules: list[tuple[str, tuple[str, ...], float]] = []
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        content = line.partition("#")[0].strip()
        if content:
            rules.append(_read_rule(content, f"{path.name}:{number}"))
    return rules


def _read_rule(line: str, where: str) -> tuple[str, tuple[str, ...], float]:
    production, _, weight = line.partition("|")
    parent, arrow, children = (part.strip() for part in production.partition("->"))
    try:
        value = float(weight)
    except ValueError:
        value = 0.0
    if not (arrow and parent and children and value > 0.0):
        raise GroundingError(f"{where}: {line!r}; allowed: LHS -> RHS RHS ... | weight above 0")
    return parent, tuple(children.split()), value


def _normalised(
    rules: list[tuple[str, tuple[str, ...], float]],
) -> list[tuple[str, tuple[str, ...], float]]:
    totals: dict[str, float] = defaultdict(float)
    for parent, _, weight in rules:
        totals[parent] += weight
    return [(parent, rhs, math.log(weight / totals[parent])) for parent, rhs, weight in rules]


def _binarised(raw: tuple[str, tuple[str, ...], float]) -> list[Rule]:
    """Splits a long rule into binary ones through `@` labels that name what they hold."""
    parent, rhs, log_probability = raw
    labels = tuple(label.lstrip("^") for label in rhs)
    spliced = tuple(label[0] in "^@" for label in rhs)
    rules: list[Rule] = []
    while len(labels) > 2:
        joined = f"@{parent}<{'_'.join(labels[:2])}"
        rules.append(Rule(joined, labels[:2], 0.0, spliced[:2]))
        labels, spliced = (joined, *labels[2:]), (True, *spliced[2:])
    return [*dict.fromkeys(rules), Rule(parent, labels, log_probability, spliced)]


def _ordered(rules: list[Rule], path: Path) -> tuple[Rule, ...]:
    graph: dict[str, set[str]] = defaultdict(set)
    for rule in rules:
        graph[rule.parent].add(rule.children[0])
    try:
        rank = {label: at for at, label in enumerate(TopologicalSorter(graph).static_order())}
    except CycleError as error:
        raise GroundingError(f"{path.name}: unary rules form a cycle: {error.args[1]}") from error
    return tuple(sorted(rules, key=lambda rule: rank[rule.parent]))
