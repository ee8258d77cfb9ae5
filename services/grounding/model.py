"""The grounding model of one robot: text to understanding, understanding to behaviours."""

from collections.abc import Iterable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robots.symbols import get_symbols
from services.grounding import behavior, doubt, sequence
from services.grounding.behavior import NONE, Objects, Pairs
from services.grounding.dcg import CorrespondenceGraph, Distribution
from services.grounding.features import SymbolFeatures, SymbolSet
from services.grounding.grammar import Grammar
from services.grounding.hdcg import HierarchicalGraph, RuleFeatures
from services.grounding.lexicon import Lexicon
from services.grounding.parser import Parse, parse
from services.grounding.sequence import SequenceReading
from services.grounding.symbols import ROBOT, UNKNOWN, SymbolTable
from services.grounding.text import MAX_WORDS, tokenize
from services.grounding.tree import Phrase
from services.grounding.understanding import (
    Intent,
    Understanding,
    annotations_of,
    intents_of,
)
from services.grounding.weights import ModelWeights, load_weights, weights_path
from services.grounding.world import WorldObjects, implied_world

NEGLIGIBLE_PARSE = 0.005
"""Trees below this posterior are not grounded; their mass is reported as lost."""
MAX_BEHAVIORS = 200
"""Pairs of objects listed for one intent in one hypothesis; the mass of others is lost."""
NEGLIGIBLE_INTENT = 0.01
"""Intents below this probability are not looked for in maps; their mass is reported as lost."""


@dataclass(frozen=True)
class Behavior:
    """One thing to do with particular objects of one map hypothesis (Γ^{A_O})."""

    probability: float
    action: str
    object: str
    """Class of the object, "robot" where the robot itself is to be placed."""
    object_index: int
    """Row in the hypothesis, `NONE` (-1) for the robot itself."""
    mode: str
    relation: str
    landmark: str
    """Class of the landmark, "unknown" if there is none."""
    landmark_index: int
    """Row in the hypothesis, `NONE` (-1) for no landmark, the robot, or one the map lacks."""
    comparative: bool


@dataclass(frozen=True)
class BehaviorDistribution:
    """p(β | S, Λ) in one map hypothesis; all masses sum to one (paper, Eq. basic-1)."""

    behaviors: tuple[Behavior, ...]
    """Best first."""
    nothing_fits: float
    """Probability that what is meant is not in this map: the reason to explore."""
    statement_mass: float
    """Probability that nothing is to be done."""
    other_mass: float
    """Probability of readings that the search left out."""


class GroundingModel:
    """Parser, correspondence graph and pair model of one robot."""

    def __init__(self, lexicon: Lexicon, weights: ModelWeights) -> None:
        self.features = SymbolFeatures(SymbolTable(lexicon.symbols), lexicon)
        self.table = self.features.table
        self.lexicon = lexicon
        self.grammar = Grammar.load()
        self.weights = weights
        self._graph = _graph(self.features, weights)
        self._possible = doubt.possible(lexicon)

    @classmethod
    def load(cls, robot: str) -> "GroundingModel":
        """Reads the robot's trained weights.

        Raises:
            UnknownLanguageError: no robot of that name has words.
            GroundingError: the robot has no weights, or the weights are of another version.
        """
        lexicon = Lexicon.load(get_symbols(robot))
        table = SymbolTable(lexicon.symbols)
        rules = RuleFeatures(table, lexicon)
        weights = load_weights(weights_path(robot), SymbolFeatures(table, lexicon), rules)
        return cls(lexicon, weights)

    def retrained(self, weights: ModelWeights) -> "GroundingModel":
        """The same words and symbols with other weights; nothing is built anew."""
        other = copy(self)
        other.weights, other._graph = weights, _graph(self.features, weights)
        return other

    @property
    def names(self) -> tuple[str, ...]:
        """Object classes followed by locations: what `WorldObjects.classes` refers to."""
        return self.table.names["class"]

    def understand(self, text: str) -> Understanding:
        """Annotation inference: what the text says about the world and asks for, without a map.

        Any text gives an answer. Equal texts give equal answers.
        """
        tokens = self.lexicon.strip_fillers(tokenize(text))
        if not tokens or len(tokens) > MAX_WORDS:
            return self._refused(text, len(tokens))
        parses = parse(tokens, self.lexicon, self.grammar)
        return self._understanding(text, parses)

    def parses(self, text: str) -> tuple[Parse, ...]:
        """The k best phrase trees of a text; of its first `MAX_WORDS` words if there are more."""
        tokens = self.lexicon.strip_fillers(tokenize(text))[:MAX_WORDS]
        return parse(tokens, self.lexicon, self.grammar)

    def readings(self, text: str) -> dict[SymbolSet, float]:
        """p(symbols of the whole sentence | text), less the mass of sets left out."""
        return self.readings_of(self.parses(text))

    def readings_of(self, parses: Sequence[Parse]) -> dict[SymbolSet, float]:
        """The same, of a text that is parsed already."""
        return self._mixed((one.probability, read.whole) for one, read in self._read(parses))

    def _read(self, parses: Sequence[Parse]) -> list[tuple[Parse, SequenceReading]]:
        """Every tree with what its clauses mean, in the order of the trees."""
        self._graph.forget()
        kept = [one for one in parses if one.probability >= NEGLIGIBLE_PARSE]
        return [(one, sequence.read(one.tree, self._graph.infer, self.table)) for one in kept]

    def _mixed(self, parts: Iterable[tuple[float, Distribution]]) -> dict[SymbolSet, float]:
        """The mixture of what several trees mean, calibrated."""
        mixed: dict[SymbolSet, float] = {}
        for share, found in parts:
            for symbols, probability in found.items():
                mixed[symbols] = mixed.get(symbols, 0.0) + share * probability
        return tempered(mixed, self.weights.temperature)

    def _understanding(self, text: str, parses: Sequence[Parse]) -> Understanding:
        best = parses[0]
        reads = self._read(parses)
        readings = self._mixed((one.probability, read.whole) for one, read in reads)
        annotations = annotations_of(readings, self.table)
        first = self._mixed((one.probability, read.first) for one, read in reads)
        intents, statement_mass = intents_of(_scaled(first, sum(readings.values())), self.table)
        words = doubt.unknown_words(best.tree, self.lexicon)
        near = doubt.suggestions(words, self.lexicon)
        understood = doubt.is_understood(annotations, intents, statement_mass, best.partial, words)
        understood = understood or (not words and _is_turn(intents, self.table))
        return Understanding(
            text=text,
            understood=understood,
            parse=best.tree.bracket(),
            parse_probability=best.probability,
            partial=best.partial,
            annotations=annotations,
            intents=intents,
            steps=_steps(intents, reads[0][1].steps, self.table),
            correction=_is_correction(best.tree),
            statement_mass=statement_mass,
            other_mass=max(0.0, 1.0 - sum(readings.values())),
            unknown_words=words,
            suggestions=near,
            possible=self._possible,
            question=doubt.question(understood, words, near, intents),
        )

    def _refused(self, text: str, words: int) -> Understanding:
        """The answer to a text that cannot be parsed: no words at all, or far too many."""
        wanted = f"at most {MAX_WORDS} words (these are {words})"
        question = f"Please say it in {wanted}." if words else "What shall I do, and where?"
        return Understanding(
            text=text,
            understood=False,
            parse="",
            parse_probability=0.0,
            partial=True,
            annotations=(),
            intents=(),
            steps=(),
            correction=False,
            statement_mass=0.0,
            other_mass=1.0,
            unknown_words=(),
            suggestions={},
            possible=self._possible,
            question=question,
        )

    def behaviors(
        self, understanding: Understanding, world: WorldObjects | None = None
    ) -> BehaviorDistribution:
        """Behaviour inference in one map hypothesis.

        Args:
            understanding: of the instruction.
            world: the hypothesis; without it, the map that the best annotation implies.
        """
        if world is None and not understanding.annotations:
            return _lost(understanding, understanding.other_mass)
        if world is None:
            world = implied_world(understanding.annotations[0], self.names)
        return self.behaviors_in_belief(understanding, (world,))[0]

    def behaviors_in_belief(
        self, understanding: Understanding, worlds: Sequence[WorldObjects]
    ) -> tuple[BehaviorDistribution, ...]:
        """Behaviour inference in all hypotheses of a belief at once, in their order.

        No hypothesis's answer depends on the others.
        """
        if not worlds:
            return ()
        objects = Objects.join(worlds)
        kept = [i for i in understanding.intents if i.probability >= NEGLIGIBLE_INTENT]
        if not understanding.understood or _is_statement(understanding):
            kept = []
        found: list[list[Behavior]] = [[] for _ in worlds]
        nothing = np.zeros(len(worlds))
        for intent in kept:
            nothing += self._ground(intent, objects, found)
        rest = 1.0 - understanding.statement_mass - nothing
        return tuple(
            BehaviorDistribution(
                tuple(sorted(behaviors, key=lambda one: -one.probability)),
                float(mass),
                understanding.statement_mass,
                max(0.0, float(left) - sum(one.probability for one in behaviors)),
            )
            for behaviors, mass, left in zip(found, nothing, rest, strict=True)
        )

    def _ground(
        self, intent: Intent, objects: Objects, found: list[list[Behavior]]
    ) -> NDArray[np.float64]:
        """Adds the behaviours of one intent to `found`; returns its "none" mass by hypothesis."""
        pairs = behavior.candidates(intent, objects, self.names)
        logits = behavior.features(intent, pairs, objects) @ self.weights.pairs
        logits += behavior.prior(intent, pairs, len(found))
        probabilities, none = behavior.pair_probabilities(logits, pairs.world, len(found))
        kept = behavior.most_probable(probabilities, pairs.world, MAX_BEHAVIORS)
        pairs = Pairs(pairs.world[kept], pairs.figure[kept], pairs.landmark[kept])
        columns = (
            pairs.world.tolist(),
            _local(pairs.figure, pairs.world, objects),
            _local(pairs.landmark, pairs.world, objects),
            (intent.probability * probabilities[kept]).tolist(),
        )
        for world, figure, landmark, probability in zip(*columns, strict=True):
            found[world].append(_behavior(intent, figure, landmark, probability))
        return intent.probability * none


def _graph(
    features: SymbolFeatures, weights: ModelWeights
) -> CorrespondenceGraph | HierarchicalGraph:
    """One pass, or two for a robot that has weights for the first."""
    if weights.rules is None:
        return CorrespondenceGraph(features, weights.factors)
    return HierarchicalGraph(features, weights.factors, weights.rules)


def tempered(readings: Mapping[SymbolSet, float], temperature: float) -> dict[SymbolSet, float]:
    """Divides log probabilities by a temperature; the lost mass counts as one more reading."""
    lost = max(0.0, 1.0 - sum(readings.values()))
    powers = {symbols: p ** (1.0 / temperature) for symbols, p in readings.items()}
    total = sum(powers.values()) + lost ** (1.0 / temperature)
    return {symbols: power / total for symbols, power in powers.items()} if total else {}


def _scaled(readings: Mapping[SymbolSet, float], total: float) -> dict[SymbolSet, float]:
    """The same proportions with another sum."""
    factor = total / (sum(readings.values()) or 1.0)
    return {symbols: factor * probability for symbols, probability in readings.items()}


def _steps(
    intents: Sequence[Intent], later: Sequence[SymbolSet], table: SymbolTable
) -> tuple[Intent, ...]:
    """What is to be done one after the other: the best intent, and those of the later clauses."""
    found = [intents_of({symbols: 1.0}, table)[0] for symbols in later[1:]]
    return (*intents[:1], *(one for (one, *_) in found)) if later else ()


def _is_turn(intents: Sequence[Intent], table: SymbolTable) -> bool:
    """Whether the robot is to turn, which needs no place."""
    sides = set(table.names["action"]) & set(table.names["relation"]) - {UNKNOWN}
    return bool(intents) and intents[0].action in sides and intents[0].object == ROBOT


def _is_correction(tree: Phrase) -> bool:
    """Whether an utterance takes back an earlier one: "no, the one behind the tree"."""
    return any(phrase.label == sequence.CORRECTION for phrase in tree.preorder())


def _is_statement(understanding: Understanding) -> bool:
    intents = understanding.intents
    return not intents or intents[0].probability < understanding.statement_mass


def _local(rows: NDArray[np.int64], world: NDArray[np.int64], objects: Objects) -> list[int]:
    """Rows of the joined columns as rows of their own hypothesis."""
    return np.where(rows == NONE, NONE, rows - objects.starts[world]).tolist()


def _behavior(intent: Intent, figure: int, landmark: int, probability: float) -> Behavior:
    return Behavior(
        probability=probability,
        action=intent.action,
        object=intent.object,
        object_index=figure,
        mode=intent.mode,
        relation=intent.relation,
        landmark=intent.landmark,
        landmark_index=landmark,
        comparative=intent.comparative,
    )


def _lost(understanding: Understanding, mass: float) -> BehaviorDistribution:
    return BehaviorDistribution((), 0.0, understanding.statement_mass, mass)
