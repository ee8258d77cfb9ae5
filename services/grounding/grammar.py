"""The weighted grammar, read from data and binarised for the chart."""

import math
from collections import defaultdict
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


@dataclass(frozen=True)
class Grammar:
    """Binarised rules, indexed the way the chart asks for them."""

    binary: dict[str, dict[str, list[Rule]]]
    """By left child, then by right child."""
    unary: tuple[Rule, ...]
    """Ordered so that a rule stands after those that build its child."""

    @classmethod
    @cache
    def load(cls, path: Path = GRAMMAR_FILE) -> "Grammar":
        """Reads a grammar file.

        Raises:
            GroundingError: a malformed line, or unary rules that form a cycle.
        """
        rules = [rule for raw in _normalised(_read(path)) for rule in _binarised(raw)]
        binary: dict[str, dict[str, list[Rule]]] = defaultdict(lambda: defaultdict(list))
        for rule in rules:
            if len(rule.children) == 2:
                binary[rule.children[0]][rule.children[1]].append(rule)
        return cls(binary, _ordered([rule for rule in rules if len(rule.children) == 1], path))


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
