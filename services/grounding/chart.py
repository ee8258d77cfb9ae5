"""CKY over a word lattice, with inside scores and lazy k-best derivations.

The k-best pass follows the lazy algorithm of Huang and Chiang, "Better k-best parsing" (2005).
"""

import heapq
import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from services.grounding.grammar import ROOT, BinaryRules, Grammar
from services.grounding.lexicon import Entry, printed
from services.grounding.tree import Phrase, Word

FRAGMENT_LABELS = (
    "S",
    "VP",
    "NP",
    "PP:dir",
    "PP:loc",
    "PP:src",
    "PP:of",
    "ADVP",
    "ADJP",
    "SBAR",
    "NEG",
)
FRAGMENT_LOG_PENALTY = -12.0
LOOSE_WORD_LOG_PENALTY = -18.0


@dataclass(eq=False, slots=True)
class Vertex:
    """One label over one span, with every way to build it."""

    label: str
    edges: "list[Edge]" = field(default_factory=list["Edge"])
    best: float = -math.inf
    inside: float = -math.inf
    derivations: "list[Derivation]" = field(default_factory=list["Derivation"])
    queue: "list[tuple[float, int, tuple[int, ...]]] | None" = None
    queued: "set[tuple[int, tuple[int, ...]]]" = field(
        default_factory=set[tuple[int, tuple[int, ...]]]
    )


@dataclass(eq=False, slots=True)
class Edge:
    """One way to build a vertex: a rule over child vertices, or a lexicon entry."""

    log_probability: float
    children: tuple[Vertex, ...]
    spliced: tuple[bool, ...]
    entry: Entry | None = None


@dataclass(frozen=True, eq=False, slots=True)
class Derivation:
    """One edge with one choice of derivation for each child vertex."""

    score: float
    edge: Edge
    ranks: tuple[int, ...]


Chart = list[list[dict[str, Vertex]]]


def fill_chart(lattice: Sequence[tuple[int, int, Entry]], length: int, grammar: Grammar) -> Chart:
    """Builds all vertices bottom-up; chart[start][end] maps a label to its vertex."""
    chart: Chart = [[{} for _ in range(length + 1)] for _ in range(length + 1)]
    for start, end, entry in lattice:
        _add(chart[start][end], entry.tag, Edge(entry.log_probability, (), (), entry))
    for width in range(1, length + 1):
        for start in range(length - width + 1):
            _fill_cell(chart, start, start + width, grammar)
    return chart


def _fill_cell(chart: Chart, start: int, end: int, grammar: Grammar) -> None:
    cell = chart[start][end]
    rules = grammar.rules_at(start)
    for middle in range(start + 1, end):
        right_cell = chart[middle][end]
        if right_cell:
            _combine(cell, chart[start][middle], right_cell, rules.binary)
    for rule in rules.unary:
        child = cell.get(rule.children[0])
        if child:
            _add(cell, rule.parent, Edge(rule.log_probability, (child,), rule.spliced))


def _combine(
    cell: dict[str, Vertex],
    left_cell: dict[str, Vertex],
    right_cell: dict[str, Vertex],
    binary: BinaryRules,
) -> None:
    for label, left in left_cell.items():
        by_right = binary.get(label)
        if by_right is None:
            continue
        for right_label in by_right.keys() & right_cell.keys():
            right = right_cell[right_label]
            for rule in by_right[right_label]:
                _add(cell, rule.parent, Edge(rule.log_probability, (left, right), rule.spliced))


def _add(cell: dict[str, Vertex], label: str, edge: Edge) -> None:
    vertex = cell.get(label)
    if vertex is None:
        vertex = cell[label] = Vertex(label)
    vertex.edges.append(edge)
    best = inside = edge.log_probability
    for child in edge.children:
        best += child.best
        inside += child.inside
    # The two cases of log(exp a + exp b), written out: this line runs once for every edge.
    high, low = (inside, vertex.inside) if inside > vertex.inside else (vertex.inside, inside)
    vertex.inside = high + math.log1p(math.exp(low - high))
    vertex.best = max(vertex.best, best)


def derivation(vertex: Vertex, rank: int) -> Derivation | None:
    """The derivation of the given rank (0 is the best), or None if there are fewer."""
    if vertex.queue is None:
        vertex.queue = []
        for number, edge in enumerate(vertex.edges):
            _enqueue(vertex, number, (0,) * len(edge.children))
    while len(vertex.derivations) <= rank and vertex.queue:
        cost, number, ranks = heapq.heappop(vertex.queue)
        vertex.derivations.append(Derivation(-cost, vertex.edges[number], ranks))
        for child in range(len(ranks)):
            successor = (*ranks[:child], ranks[child] + 1, *ranks[child + 1 :])
            _enqueue(vertex, number, successor)
    return vertex.derivations[rank] if rank < len(vertex.derivations) else None


def _enqueue(vertex: Vertex, number: int, ranks: tuple[int, ...]) -> None:
    if (number, ranks) in vertex.queued or vertex.queue is None:
        return
    vertex.queued.add((number, ranks))
    edge = vertex.edges[number]
    score = edge.log_probability
    for child, rank in zip(edge.children, ranks, strict=True):
        found = derivation(child, rank)
        if found is None:
            return
        score += found.score
    # Ties are broken by edge and ranks, so that equal texts give equal trees.
    heapq.heappush(vertex.queue, (-score, number, ranks))


def build_tree(vertex: Vertex, found: Derivation) -> list[Phrase | Word]:
    """The nodes that a derivation contributes to its parent: one, or several for an `@` label."""
    nodes: list[Phrase | Word] = []
    if found.edge.entry:
        return [Word(printed(vertex.label), found.edge.entry.text)]
    for child, rank, spliced in zip(
        found.edge.children, found.ranks, found.edge.spliced, strict=True
    ):
        below = derivation(child, rank)
        assert below is not None
        built = build_tree(child, below)
        splice = spliced and not child.label.startswith("@")
        nodes += list(_only_phrase(built).children) if splice else built
    return nodes if vertex.label[0] == "@" else [Phrase(printed(vertex.label), tuple(nodes))]


def _only_phrase(nodes: list[Phrase | Word]) -> Phrase:
    (phrase,) = nodes
    assert isinstance(phrase, Phrase)
    return phrase


def root_vertex(chart: Chart) -> Vertex | None:
    """The vertex of complete parses, if there is one."""
    return chart[0][-1].get(ROOT)


def fragment_cover(chart: Chart) -> tuple[list[Vertex], float]:
    """The best sequence of phrases and loose words that covers the sentence, and its score."""
    length = len(chart) - 1
    best: list[tuple[float, list[Vertex]]] = [(0.0, [])]
    for end in range(1, length + 1):
        options = [
            (best[start][0] + vertex.best + penalty, [*best[start][1], vertex])
            for start in range(end)
            for vertex, penalty in _fragments(chart[start][end])
        ]
        best.append(max(options, key=lambda option: option[0], default=(-math.inf, [])))
    return best[-1][1], best[-1][0]


def _fragments(cell: dict[str, Vertex]) -> list[tuple[Vertex, float]]:
    phrases = [(cell[label], FRAGMENT_LOG_PENALTY) for label in FRAGMENT_LABELS if label in cell]
    words = [
        (vertex, LOOSE_WORD_LOG_PENALTY)
        for vertex in cell.values()
        if any(edge.entry for edge in vertex.edges)
    ]
    return phrases + words
